"""Each rule of the page of semantics names a test that exists and asserts something."""

import ast
import re
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
PAGE = (ROOT / "docs" / "reference" / "semantics.md").read_text(encoding="utf-8")
RULES = re.findall(r"^\| (\d+) \| (.+?) \| `(\S+)::(\w+)` \|$", PAGE, re.MULTILINE)


def test_the_rules_are_numbered_in_order():
    assert [int(number) for number, *_ in RULES] == list(range(1, len(RULES) + 1))
    assert len(RULES) == len(re.findall(r"^\| \d", PAGE, re.MULTILINE))


@pytest.mark.parametrize(("file", "name"), [(file, name) for _, _, file, name in RULES], ids=str)
def test_a_rule_has_a_test(file, name):
    tree = ast.parse((ROOT / "tests" / file).read_text(encoding="utf-8"))
    found = [one for one in tree.body if isinstance(one, ast.FunctionDef) and one.name == name]
    assert len(found) == 1
    checks = [one for one in ast.walk(found[0]) if isinstance(one, ast.Assert)]
    raises = [one for one in ast.walk(found[0]) if isinstance(one, ast.Attribute) and one.attr == "raises"]
    assert checks or raises
