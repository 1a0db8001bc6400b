/**
 * The grammar of `.maze-machine` files for tree-sitter, after `hsm/dsl/syntax/grammar.lark`.
 *
 * The words that lines begin with are keywords only there, so a state may be called `exit`. The external scanner
 * (`src/scanner.c`) finds where lines and blocks end, counts brackets, and reads numbers with their units. A division in a condition or
 * a duration is written in parentheses, because a bare slash begins the actions: there are two families of operators.
 */

const commaSeparated = (rule) => seq(rule, repeat(seq(",", rule)));

/** What may follow a trigger. */
const clauses = ($) => [optional($.guard), optional($.target), optional($.actions)];

/** The rules of expressions over a kind of factor: `divided` ones hold divisions, `undivided` ones do not. */
function expressions(family, factor) {
  const named = (name) => `${name}_${family}`;
  const hidden = (name) => `_${name}_${family}`;
  return {
    [hidden("disjunction")]: ($) =>
      choice($[hidden("conjunction")], alias($[named("disjunction")], $.disjunction)),
    [named("disjunction")]: ($) =>
      seq($[hidden("conjunction")], repeat1(seq("or", $[hidden("conjunction")]))),
    [hidden("conjunction")]: ($) =>
      choice($[hidden("negation")], alias($[named("conjunction")], $.conjunction)),
    [named("conjunction")]: ($) => seq($[hidden("negation")], repeat1(seq("and", $[hidden("negation")]))),
    [hidden("negation")]: ($) => choice($[hidden("comparison")], alias($[named("negation")], $.negation)),
    [named("negation")]: ($) => seq("not", $[hidden("negation")]),
    [hidden("comparison")]: ($) => choice($[hidden("sum")], alias($[named("comparison")], $.comparison)),
    [named("comparison")]: ($) =>
      seq(
        field("left", $[hidden("sum")]),
        field("operator", choice("==", "!=", "<=", ">=", "<", ">")),
        field("right", $[hidden("sum")]),
      ),
    [hidden("sum")]: ($) => choice($[hidden("product")], alias($[named("sum")], $.sum)),
    [named("sum")]: ($) =>
      seq(
        field("left", $[hidden("sum")]),
        field("operator", choice("+", "-")),
        field("right", $[hidden("product")]),
      ),
    [hidden("product")]: ($) => choice($._unary, alias($[named("product")], $.product)),
    [named("product")]: ($) =>
      seq(
        field("left", $[hidden("product")]),
        field("operator", factor),
        field("right", $._unary),
      ),
  };
}

module.exports = grammar({
  name: "maze_machine",

  // The order is that of `enum Token` in src/scanner.c. The scanner never finds the last three: `_anywhere` is valid
  // everywhere, `_here` where a statement may begin, and after what must not be comes `_never`. No rule has a place for
  // `_misplaced`, the indentation of a line where no block begins: it is an error wherever the scanner finds it.
  externals: ($) => [
    $._line_end,
    $._block_begin,
    $._block_end,
    $._misplaced,
    $.number,
    "(",
    ")",
    $._anywhere,
    $._here,
    $._never,
  ],

  // As an extra, `_anywhere` has the scanner asked before every token, so that a line break ends a statement wherever it
  // is, and is skipped only between statements and within brackets.
  extras: ($) => [/[ \t]/, /\r?\n/, $._anywhere, $.comment],

  word: ($) => $.name,

  rules: {
    file: ($) => repeat($._item),

    comment: () => /#[^\n]*/,

    _item: ($) =>
      choice(
        $._statement,
        // The end of a line that cannot be read, which brings the parser back to where a statement begins.
        $._line_end,
        $._here,
      ),

    _statement: ($) =>
      choice(
        $.machine,
        $.import,
        $.parameter,
        $.variable,
        $.event,
        $.expose,
        $.enumeration,
        $.definition,
        $.property,
        $.assumption,
        $.state,
        $.member,
        $.parallel,
        $.final,
        $.initial,
        $.activity,
        $.entry,
        $.exit,
        $.on,
        $.when,
        $.else,
        $.after,
        $.every,
        $.defer,
        $.stay,
      ),

    // Declarations.

    machine: ($) => seq("machine", field("name", $._name), $._line_end),
    import: ($) => seq("import", field("name", $._name), $._line_end),
    parameter: ($) =>
      seq(
        "param",
        field("name", $._name),
        ":",
        field("type", $._type),
        optional(seq("=", field("default", $._expression))),
        optional(seq(",", $.adjustable)),
        $._line_end,
      ),
    adjustable: ($) =>
      seq("adjustable", optional(seq("(", $._expression, ",", $._expression, ")"))),
    variable: ($) =>
      seq(
        "var",
        field("name", $._name),
        ":",
        field("type", $._type),
        "=",
        field("value", $._expression),
        $._line_end,
      ),
    event: ($) => seq("event", commaSeparated($._declared_event), $._line_end),
    _declared_event: ($) => seq(field("name", $._name), optional($.fields)),
    fields: ($) => seq("(", commaSeparated($.field), ")"),
    field: ($) => seq(field("name", $._name), ":", field("type", $._type)),
    expose: ($) => seq("expose", commaSeparated(field("name", $._name)), $._line_end),
    enumeration: ($) =>
      seq("enum", field("name", $._name), "=", commaSeparated(field("value", $._name)), $._line_end),
    definition: ($) => seq("define", field("name", $._name), "=", field("value", $._expression), $._line_end),
    property: ($) => seq("property", field("name", $._name), ":", field("claim", $.claim), $._line_end),
    assumption: ($) => seq("assume", field("name", $._name), ":", field("claim", $.claim), $._line_end),
    claim: ($) =>
      choice(
        seq("never", $._condition),
        seq("always", $._condition),
        seq("always", "eventually", $._condition, "within", $._duration),
        seq("after", $._condition, ",", $._condition, "within", $._duration),
        seq("after", $._condition, ",", $._condition, "before", $._condition),
      ),
    _claim_condition: ($) => $._condition,

    // States.

    state: ($) =>
      seq("state", field("name", $._name), optional(seq("=", field("instance", $._called))), $._line_end, optional($.block)),
    member: ($) => seq("member", field("name", $._name), "=", field("instance", $._called), $._line_end, optional($.block)),
    parallel: ($) => seq("parallel", field("name", $._name), $._line_end, optional($.block)),
    block: ($) => seq($._block_begin, repeat1($._item), $._block_end),
    final: ($) => seq("final", field("name", $._name), $._line_end),
    initial: ($) => seq("initial", field("name", $._name), optional($.actions), $._line_end),
    activity: ($) => seq("do", $._called, $._line_end),
    entry: ($) => seq("entry", $.actions, $._line_end),
    exit: ($) => seq("exit", $.actions, $._line_end),

    // Transitions.

    on: ($) => seq("on", commaSeparated(field("event", choice($._name, $.any))), ...clauses($), $._line_end),
    any: () => "*",
    when: ($) =>
      seq("when", field("condition", $._condition), optional($.lasting), ...clauses($), $._line_end),
    else: ($) => seq("else", optional($.target), optional($.actions), $._line_end),
    after: ($) => seq("after", field("duration", $._duration), ...clauses($), $._line_end),
    every: ($) => seq("every", field("duration", $._duration), ...clauses($), $._line_end),
    defer: ($) =>
      seq("defer", commaSeparated(field("event", choice($._name, $.any))), optional($.guard), $._line_end),
    stay: ($) => seq("stay", optional(seq("when", field("condition", $._condition))), $._line_end),

    guard: ($) => seq("if", $._condition),
    lasting: ($) => seq("for", $._duration),
    target: ($) => seq(choice("->", "=>"), commaSeparated(field("state", $._name))),
    actions: ($) => seq("/", commaSeparated($._action)),

    _action: ($) => choice($.assignment, $.call, alias($._call_of_word, $.call), $.raise, $.send, $.cancel),
    // `cancel` and `send` are names where no event follows.
    _word: ($) => choice("cancel", "send"),
    _call_of_word: ($) => seq(field("function", alias($._word, $.name)), field("arguments", $.arguments)),
    assignment: ($) =>
      seq(
        field("variable", choice($._name, alias($._word, $.name))),
        field("operator", choice("=", "+=", "-=", "*=")),
        field("value", $._expression),
      ),
    raise: ($) => seq("raise", $._sent_event, optional(seq("after", $._duration))),
    send: ($) => seq("send", $._sent_event),
    _sent_event: ($) => seq(field("event", $._name), optional(field("data", $.arguments))),
    cancel: ($) => seq("cancel", field("event", $._name)),

    // Expressions.

    _expression: ($) => choice($._disjunction_divided, $.choice),
    choice: ($) => seq($._disjunction_divided, "if", $._disjunction_divided, "else", $._expression),
    _condition: ($) => $._disjunction_undivided,
    _duration: ($) => $._sum_undivided,
    ...expressions("divided", choice("*", "/")),
    ...expressions("undivided", "*"),
    _unary: ($) => choice($._atom, $.negative),
    negative: ($) => seq("-", $._unary),
    _atom: ($) => choice($.name, $.number, $.call, $.group, $._not_a_name),
    group: ($) => seq("(", $._expression, ")"),
    call: ($) => seq(field("function", $.name), field("arguments", $.arguments)),
    // A call where no expression may stand, so that only here the reserved words have to be kept from being its function.
    _called: ($) => alias($._call_of_name, $.call),
    _call_of_name: ($) => seq(field("function", $._name), field("arguments", $.arguments)),
    arguments: ($) => seq("(", optional(commaSeparated(choice($._expression, $.named_argument))), ")"),
    named_argument: ($) => seq(field("name", $._name), "=", field("value", $._expression)),

    // Names. A reserved word in the place of a name is an error.

    name: () => /[A-Za-z_][A-Za-z0-9_]*(\.[A-Za-z_][A-Za-z0-9_]*)*/,
    _name: ($) => choice($.name, $._not_a_name, $._no_name_either),
    _not_a_name: ($) => seq(choice("and", "if", "or", "raise"), $._never),
    _no_name_either: ($) => seq("not", $._never),
    _type: ($) => alias($.name, $.type),
  },
});
