"""The data models' expressions mean what they mean in ECMAScript and in Python."""

import json
import random
import shutil
import subprocess

import pytest

from hsm.interchange.scxml.datamodel.ecmascript import EcmaScriptLanguage
from hsm.interchange.scxml.datamodel.expressions import DataError, Environment
from hsm.interchange.scxml.datamodel.python import PythonLanguage
from hsm.interchange.scxml.datamodel.tokens import InvalidExpressionError, UnsupportedError
from hsm.model.messages import Store

DATA = {"x": 3, "y": 2.5, "s": "7", "t": "ab", "yes": True, "names": ["a", "b"], "point": {"x": 1, "deep": {"y": 2}}}
ENVIRONMENT = Environment(Store(DATA), set(), {}, {})
ECMASCRIPT = {
    "atoms": """x y s t yes 0 1 2.0 1e21 0.000001 (-7) '3' '' 'b' true false names.length names[0] t[1] point.deep.y
        point['x'] point.none===undefined '0.5' 1e-7""",
    "binary": "+ - * / % < <= > >= == != === !== && || + +",
    "unary": """!{} -(+{}) +(-{}) typeof({}) String({}) Boolean({}) Math.abs({}) Math.floor({}) Math.ceil({})
        Math.round({}) Math.max({},1) Math.min({},2) 'abc'.indexOf({}) 'a7b'.includes({})""",
    "choice": "({} ? {} : {})",
}
PYTHON = {
    "atoms": """x y s t yes 0 1 2.0 1e21 (-7) '3' '' 'b' True False None names[0] names[-1] t[1] names point['deep']
        point['x'] len(names) [1,2] {'a':1}""",
    "binary": "+ - * / % // < <= > >= == != and or in +",
    "unary": """(not({})) -{} +{} str({}) bool({}) abs({}) int({}) max({},1) (0<{}<3) (x)if({})else(y) float({}) len({})
        round({}) 'abc'.startswith({})""",
    "choice": "({1} if {0} else {2})",
}


def expressions(words, count, seed):
    """Random expressions, of operators and atoms of a language."""
    chance = random.Random(seed)

    def one(depth):
        roll = chance.random()
        if depth == 0 or roll < 0.25:
            return chance.choice(words["atoms"].split())
        if roll < 0.5:
            return "(" + chance.choice(words["unary"].split()).format(one(depth - 1)) + ")"
        if roll < 0.6:
            return words["choice"].format(one(depth - 1), one(depth - 1), one(depth - 1))
        left, right = one(depth - 1), one(depth - 1)
        return f"({left} {chance.choice(words['binary'].split())} {right})"

    return [one(3) for _ in range(count)]


def whole(text):
    """A number of JavaScript, which writes numbers beyond 2**53 without an exponent, too."""
    return int(text) if abs(int(text)) <= 2**53 else float(text)


def found(language, text):
    """The value of an expression, or "error"."""
    try:
        return language.read(text)(ENVIRONMENT)
    except DataError:
        return "error"


def differences(language, texts, right):
    """The expressions with another value than the right one, and how many have a value; "error" stands for none."""
    ours = [found(language, text) for text in texts]
    wrong = [
        (text, mine, other)
        for text, mine, other in zip(texts, ours, right, strict=True)
        if mine != "error" and (mine != other or isinstance(mine, bool) != isinstance(other, bool))
    ]
    return wrong, sum(one != "error" for one in ours)


def test_python_means_what_it_means_in_python():
    texts = expressions(PYTHON, 4000, 1)
    right = []
    for text in texts:
        try:
            right.append(eval(text, {}, dict(DATA)))
        except (TypeError, ValueError, ZeroDivisionError, OverflowError, LookupError):
            right.append("error")
    wrong, valued = differences(PythonLanguage, texts, right)
    joins_texts = [one for one in wrong if one[2] == "error" and "+" in one[0]]
    assert [one for one in wrong if one not in joins_texts] == []
    assert valued > 1000


@pytest.mark.skipif(shutil.which("node") is None, reason="node is not installed")
def test_ecmascript_means_what_it_means_in_node():
    texts = expressions(ECMASCRIPT, 6000, 1)
    program = f"""
        const {{{", ".join(DATA)}}} = {json.dumps(DATA)};
        const shown = value => typeof value === "number" && !Number.isFinite(value) ? "error" : value;
        const valued = text => {{ try {{ return shown(eval(text)) }} catch (error) {{ return "error" }} }};
        console.log(JSON.stringify({json.dumps(texts)}.map(valued)));
    """
    answer = subprocess.run(["node", "-"], input=program, capture_output=True, text=True, check=True, timeout=60)
    wrong, valued = differences(EcmaScriptLanguage, texts, json.loads(answer.stdout, parse_int=whole))
    assert wrong == []
    assert valued > 3000


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("-5 % 3", -2),
        ("'n' + 4 / 2", "n2"),
        ("'n' + 1e21", "n1e+21"),
        ("'n' + 123456789012345680000", "n123456789012345680000"),
        ("'n' + 0.000001", "n0.000001"),
        ("'n' + 1.5e-7", "n1.5e-7"),
        ("'1' == 1", True),
        ("'1' === 1", False),
        ("true + 1", 2),
        ("'5' * '2'", 10),
        ("'10' < 9", False),
        ("'10' < '9'", True),
        ("!x == y", False),
        ("3 > 2 > 1", False),
        ("[1, 2] + 'a'", "1,2a"),
        ("2 in names", False),
        ("typeof nowhere", "undefined"),
        ("typeof x", "number"),
        ("typeof true", "boolean"),
        ("typeof point.none", "undefined"),
        (r"'\x41\u0042'", "AB"),
        ("9007199254740993 - 9007199254740992", 0),
    ],
)
def test_what_ecmascript_means_where_languages_differ(text, expected):
    assert EcmaScriptLanguage.read(text)(ENVIRONMENT) == expected


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("-5 % 3", 1),
        ("4 / 2", 2.0),
        ("7 // 2", 3),
        ("0 < x < 3", False),
        ("not []", True),
        ("'1' == 1", False),
        ("True == 1", True),
        ("x if x > 2 else y", 3),
        ("'a' not in names", False),
        ("[1] == [1]", True),
        ("x is not None", True),
    ],
)
def test_what_python_means_where_languages_differ(text, expected):
    assert PythonLanguage.read(text)(ENVIRONMENT) == expected


BEYOND = {
    EcmaScriptLanguage: """
        x = 1|x = = 1|x++|`a`|/a/|[...names]|x?.y|x ?? 1|0x10|1n|1_000|1, 2|x ** 2|x >> 1|x & 1|~x|x ^ 1|len(x)|str(x)
        |isNaN(x)|names.push(1)|Math.PI|({[x]: 1})|new Date()|void 0|010|ä|'\\q'|f'a'""",
    PythonLanguage: """
        x ** 2|x >> 1|x & 1|~x|lambda: 1|[i for i in x]|f'a'|r'a'|'a' 'b'|\'\'\'a\'\'\'|names[0:1]|x is y|1, 2|1_0|0x10
        |(x := 1)|sorted(x)|str(object=x)|{x: 1}|names.append(1)|()""",
}


@pytest.mark.parametrize(
    ("language", "text"), [(language, text) for language, texts in BEYOND.items() for text in texts.split("|")]
)
def test_what_means_something_and_is_not_in_the_subset_is_refused(language, text):
    with pytest.raises(UnsupportedError):
        language.read(text.strip())


def test_only_a_name_without_data_is_undefined():
    with pytest.raises(DataError):
        EcmaScriptLanguage.read("typeof nowhere.x")(ENVIRONMENT)


@pytest.mark.parametrize(
    ("language", "text"),
    [
        *(
            (EcmaScriptLanguage, text)
            for text in ("x and y", "not x", "1 = 1", "return", "x!", "a b", "(1", "#x", "1 +")
        ),
        *((PythonLanguage, text) for text in ("x && y", "!x", "x === 1", "x = 1", "return", "x!", "a b", "(1", "1 +")),
    ],
)
def test_what_is_no_expression_of_the_language(language, text):
    with pytest.raises(InvalidExpressionError):
        language.read(text)
