"""The types of the protocol that are completed at first use are the types that attrs completes at once."""

import re
import subprocess
import sys

SCRIPT = """
import sys
{defer}
import attrs
from lsprotocol import converters, types

known = [one for _, one in sorted(types.ALL_TYPES_MAP.items()) if isinstance(one, type)]

def incomplete():
    return sum("AtFirstUse" in type(vars(one).get("__attrs_attrs__")).__name__ for one in known)

converter = converters.get_converter()
print(len(known), incomplete(), file=sys.stderr)
asked = {{"processId": None, "rootUri": "file:///tmp", "capabilities": {{
    "general": {{"positionEncodings": ["utf-8", "utf-16"]}},
    "textDocument": {{"completion": {{"completionItem": {{"snippetSupport": True}}}}, "diagnostic": {{}}}},
}}}}
print(converter.unstructure(converter.structure(asked, types.InitializeParams)))
first, second = types.Position(1, 2), types.Position(line=1, character=3)
print(first, first < second, first == types.Position(1, 2), types.Position.__hash__)
print(types.Range(first, second), attrs.evolve(types.Range(first, second), end=first), attrs.has(types.Hover))
for wrong in (lambda: types.Position("1", 2), lambda: types.Position(), lambda: types.Hover(contents=1, no=2)):
    try:
        wrong()
    except Exception as error:
        print(type(error).__name__, str(error).replace("made()", "Position.__init__()"))
print(incomplete(), file=sys.stderr)
for one in known:
    if attrs.has(one):
        # Those with slots have the fields as attributes of the class, and pickle differently.
        aside = {{"__dict__", "__weakref__", "__slots__", "__getstate__", "__setstate__", "__attrs_own_setattr__"}}
        aside.update(attrs.fields_dict(one))
        print(one.__name__, attrs.fields(one), sorted(set(dir(one)) - aside))
print(incomplete(), file=sys.stderr)
"""
ADDRESS = re.compile(r" at 0x[0-9a-f]+")
DEFER = "from hsm.dsl.lsp.deferred import defer_types; defer_types()"


def said(defer):
    done = subprocess.run(
        [sys.executable, "-c", SCRIPT.format(defer=defer)], capture_output=True, text=True, check=True
    )
    (known, first), (second,), (third,) = (map(int, line.split()) for line in done.stderr.splitlines())
    return done.stdout, known, first, second, third


def test_they_are_the_same_types():
    usual, deferred = said(""), said(DEFER)
    for one, other in zip(usual[0].splitlines(), deferred[0].splitlines(), strict=True):
        assert ADDRESS.sub("", one) == ADDRESS.sub("", other)
    assert usual[2:] == (0, 0, 0)
    classes, first, second, third = deferred[1:]
    assert classes * 0.7 < second < first
    assert third == 0
