// The external scanner of .maze-machine files: ends of lines, beginnings and ends of blocks, brackets, numbers with
// units.
//
// It follows hsm/dsl/syntax/lexer.py. A line within brackets continues the one before, unless it begins like a
// statement: then the bracket was never closed. A tab is as wide as four blanks.

#include "tree_sitter/alloc.h"
#include "tree_sitter/array.h"
#include "tree_sitter/parser.h"

#include <string.h>

enum Token { LINE_END, BLOCK_BEGIN, BLOCK_END, MISPLACED, NUMBER, OPEN, CLOSE, ANYWHERE, HERE, NEVER };

// Where the scanner is: how many brackets are open, and the indentations of the open blocks, with that of the file
// itself first. There is none before the first token.
typedef struct {
    uint8_t brackets;
    Array(uint16_t) levels;
} Scanner;

#define TAB 4
#define WIDEST 65535

void *tree_sitter_maze_machine_external_scanner_create(void) {
    Scanner *scanner = ts_calloc(1, sizeof(Scanner));
    array_init(&scanner->levels);
    return scanner;
}

void tree_sitter_maze_machine_external_scanner_destroy(void *payload) {
    Scanner *scanner = payload;
    array_delete(&scanner->levels);
    ts_free(scanner);
}

// One byte for the brackets. A level takes one byte, its distance to the one before, or three where that is 255 or more.
unsigned tree_sitter_maze_machine_external_scanner_serialize(void *payload, char *buffer) {
    Scanner *scanner = payload;
    if (scanner->levels.size == 0) return 0;
    unsigned size = 0;
    uint16_t before = 0;
    buffer[size++] = (char)scanner->brackets;
    for (uint32_t i = 0; i < scanner->levels.size; i++) {
        uint16_t level = *array_get(&scanner->levels, i);
        uint16_t step = level - before;
        if (size + 3 > TREE_SITTER_SERIALIZATION_BUFFER_SIZE) break;
        if (step < 255) {
            buffer[size++] = (char)step;
        } else {
            buffer[size++] = (char)255;
            buffer[size++] = (char)(step >> 8);
            buffer[size++] = (char)(step & 255);
        }
        before = level;
    }
    return size;
}

void tree_sitter_maze_machine_external_scanner_deserialize(void *payload, const char *buffer, unsigned length) {
    Scanner *scanner = payload;
    array_clear(&scanner->levels);
    scanner->brackets = length > 0 ? (uint8_t)buffer[0] : 0;
    uint16_t level = 0;
    for (unsigned i = 1; i < length; i++) {
        uint16_t step = (uint8_t)buffer[i];
        if (step == 255) {
            step = (uint16_t)(((uint8_t)buffer[i + 1] << 8) | (uint8_t)buffer[i + 2]);
            i += 2;
        }
        level += step;
        array_push(&scanner->levels, level);
    }
}

static bool is_digit(int32_t c) { return c >= '0' && c <= '9'; }
static bool is_letter(int32_t c) { return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z'); }
static bool is_word(int32_t c) { return is_letter(c) || is_digit(c) || c == '_'; }

static void advance(TSLexer *lexer) { lexer->advance(lexer, false); }
static void skip(TSLexer *lexer) { lexer->advance(lexer, true); }

static bool advance_digits(TSLexer *lexer) {
    bool any = false;
    for (; is_digit(lexer->lookahead); advance(lexer)) any = true;
    return any;
}

// The divisor of a unit: a slash, at most three letters, and perhaps a power.
static void scan_divisor(TSLexer *lexer) {
    advance(lexer);
    int letters = 0;
    for (; is_letter(lexer->lookahead); advance(lexer)) letters++;
    if (letters == 0 || letters > 3 || is_word(lexer->lookahead)) return;
    lexer->mark_end(lexer);
    if (lexer->lookahead != '^') return;
    advance(lexer);
    if (advance_digits(lexer)) lexer->mark_end(lexer);
}

// A unit, where `letter` is its first one and was already taken (0: none was).
static void scan_unit(TSLexer *lexer, int32_t letter) {
    static const char *const EXCLUDED[] = {"and", "or", "if", "else", "for", "within", "before"};
    char word[8] = {0};
    unsigned length = 0;
    if (letter) word[length++] = (char)letter;
    for (; is_letter(lexer->lookahead); advance(lexer)) {
        if (length < sizeof word - 1) word[length] = (char)lexer->lookahead;
        length++;
    }
    if (length == 0) return;
    if (!is_word(lexer->lookahead) && length < sizeof word) {
        for (unsigned i = 0; i < sizeof EXCLUDED / sizeof *EXCLUDED; i++) {
            if (strcmp(word, EXCLUDED[i]) == 0) return;
        }
    }
    lexer->mark_end(lexer);
    if (lexer->lookahead == '/') scan_divisor(lexer);
}

static bool scan_number(TSLexer *lexer) {
    lexer->result_symbol = NUMBER;
    advance_digits(lexer);
    lexer->mark_end(lexer);
    if (lexer->lookahead == '.') {
        advance(lexer);
        if (!advance_digits(lexer)) return true;
        lexer->mark_end(lexer);
    }
    if (lexer->lookahead == 'e' || lexer->lookahead == 'E') {
        int32_t letter = lexer->lookahead;
        advance(lexer);
        if (lexer->lookahead == '+' || lexer->lookahead == '-') {
            lexer->mark_end(lexer);  // a unit, unless digits follow: then this is moved on
            advance(lexer);
            if (advance_digits(lexer)) lexer->mark_end(lexer);
            else return true;
        } else if (advance_digits(lexer)) {
            lexer->mark_end(lexer);
        } else {
            scan_unit(lexer, letter);
            return true;
        }
    }
    while (lexer->lookahead == ' ' || lexer->lookahead == '\t') advance(lexer);
    scan_unit(lexer, 0);
    return true;
}

static const char *const STATEMENTS[] = {
    "machine", "import", "param", "var",   "event", "state", "parallel", "final",    "initial", "do",    "entry",  "exit",
    "on",      "when",   "else",  "after", "every", "stay",  "property", "enum",     "define",  "defer", "expose", "member",
};

static bool at_blank(TSLexer *lexer, bool breaks) {
    int32_t c = lexer->lookahead;
    return c == ' ' || c == '\t' || (breaks && (c == '\n' || c == '\r'));
}

// Whether an arrow, a slash or nothing follows: an `else` with a value after it is within an expression.
static bool at_end_of_else(TSLexer *lexer) {
    while (at_blank(lexer, false)) advance(lexer);
    if (lexer->eof(lexer)) return true;
    switch (lexer->lookahead) {
        case '/': case '#': case '\r': case '\n': return true;
        case '-': case '=': advance(lexer); return lexer->lookahead == '>';
        default: return false;
    }
}

// Whether the word that comes next begins statements. It is looked at and not taken.
static bool at_statement(TSLexer *lexer) {
    char word[10] = {0};
    unsigned length = 0;
    for (; is_word(lexer->lookahead); advance(lexer)) {
        if (length < sizeof word - 1) word[length] = (char)lexer->lookahead;
        length++;
    }
    if (length >= sizeof word || lexer->lookahead == '.') return false;
    for (unsigned i = 0; i < sizeof STATEMENTS / sizeof *STATEMENTS; i++) {
        if (strcmp(word, STATEMENTS[i]) == 0) return strcmp(word, "else") != 0 || at_end_of_else(lexer);
    }
    return false;
}

// Takes a line break; false where a carriage return stands alone.
static bool advance_line_break(TSLexer *lexer) {
    if (lexer->lookahead == '\r') advance(lexer);
    if (lexer->lookahead != '\n') return false;
    advance(lexer);
    return true;
}

// What comes before the next statement or comment.
typedef struct {
    bool line_break;
    bool at_end;     // of the text
    bool comment;    // a comment comes next
    uint16_t width;  // the indentation of what comes next
} Gap;

// Takes blanks and line breaks; false where a carriage return stands alone.
static bool scan_gap(TSLexer *lexer, Gap *gap) {
    unsigned width = 0;
    for (;;) {
        int32_t c = lexer->lookahead;
        if (c == ' ' || c == '\t') {
            width += c == ' ' ? 1 : TAB;
            advance(lexer);
        } else if (c == '\n' || c == '\r') {
            if (!advance_line_break(lexer)) return false;
            gap->line_break = true;
            width = 0;
        } else {
            break;
        }
    }
    gap->at_end = lexer->eof(lexer);
    gap->comment = lexer->lookahead == '#';
    gap->width = (uint16_t)(width < WIDEST ? width : WIDEST);
    return true;
}

// The gap after comments, which are looked at and not taken.
static bool look_beyond_comments(TSLexer *lexer, Gap *gap) {
    while (gap->comment) {
        while (!lexer->eof(lexer) && lexer->lookahead != '\n') advance(lexer);
        if (!scan_gap(lexer, gap)) return false;
    }
    return true;
}

static bool found(TSLexer *lexer, enum Token token) {
    lexer->result_symbol = token;
    return true;
}

// Where a statement begins: the end or the beginning of a block, or a line in the wrong place. Ends and beginnings take
// nothing; comments that are indented like a block belong to it.
static bool scan_before_statement(Scanner *scanner, TSLexer *lexer, const bool *valid) {
    bool first = scanner->levels.size == 0;
    if (first) array_push(&scanner->levels, 0);
    uint16_t innermost = *array_back(&scanner->levels);
    lexer->mark_end(lexer);
    Gap next = {0};
    if (!scan_gap(lexer, &next)) return false;
    Gap beyond = next;
    if (!look_beyond_comments(lexer, &beyond)) return false;
    uint16_t width = beyond.at_end || (first && !beyond.line_break) ? 0 : beyond.width;
    if (width < innermost && !(next.comment && next.width >= innermost)) {
        array_pop(&scanner->levels);
        return found(lexer, BLOCK_END);
    }
    if (width > innermost && valid[BLOCK_BEGIN]) {
        array_push(&scanner->levels, width);
        return found(lexer, BLOCK_BEGIN);
    }
    if (width > innermost && !next.comment) {
        lexer->mark_end(lexer);
        return found(lexer, MISPLACED);
    }
    return false;
}

static bool scan_bracket(Scanner *scanner, TSLexer *lexer) {
    bool open = lexer->lookahead == '(';
    advance(lexer);
    lexer->mark_end(lexer);
    if (open && scanner->brackets < UINT8_MAX) scanner->brackets++;
    if (!open && scanner->brackets > 0) scanner->brackets--;
    return found(lexer, open ? OPEN : CLOSE);
}

// Passes over blanks and line breaks; false where a carriage return stands alone.
static bool skip_gap(TSLexer *lexer) {
    while (at_blank(lexer, true)) {
        bool returned = lexer->lookahead == '\r';
        skip(lexer);
        if (returned && lexer->lookahead != '\n') return false;
    }
    return true;
}

// Within a statement: its end, a bracket or a number.
static bool scan_within_statement(Scanner *scanner, TSLexer *lexer, const bool *valid) {
    if (scanner->levels.size == 0) array_push(&scanner->levels, 0);
    while (at_blank(lexer, false)) skip(lexer);
    if (at_blank(lexer, true)) {
        if (scanner->brackets == 0) {
            if (!advance_line_break(lexer)) return false;
            lexer->mark_end(lexer);
            return found(lexer, LINE_END);
        }
        lexer->mark_end(lexer);
        if (!skip_gap(lexer)) return false;
        if (is_letter(lexer->lookahead)) {
            if (!at_statement(lexer)) return false;
            scanner->brackets = 0;
            return found(lexer, LINE_END);
        }
    }
    if (lexer->eof(lexer)) {
        lexer->mark_end(lexer);
        return valid[LINE_END] && found(lexer, LINE_END);
    }
    if (lexer->lookahead == '(' || lexer->lookahead == ')') return scan_bracket(scanner, lexer);
    return is_digit(lexer->lookahead) && scan_number(lexer);
}

bool tree_sitter_maze_machine_external_scanner_scan(void *payload, TSLexer *lexer, const bool *valid) {
    bool recovering = valid[NEVER] && valid[NUMBER];  // after an error, everything is valid
    if (valid[HERE] && !recovering) return scan_before_statement(payload, lexer, valid);
    return scan_within_statement(payload, lexer, valid);
}
