"""No misspelt element, attribute or value of SCXML is accepted: each is named, with a suggestion."""

import pytest

from hsm import MachineError
from hsm.interchange.scxml import read_text
from hsm.interchange.scxml.vocabulary import RULES

OPAQUE = ("content", "data", "assign")


def ways_in():
    """For each element, the elements that it may lie in, from the outermost."""
    found = {"scxml": ("scxml",)}
    pending = ["scxml"]
    for parent in pending:
        for child in sorted(RULES[parent].children if parent not in OPAQUE else ()):
            if child not in found:
                found[child] = (*found[parent], child)
                pending.append(child)
    return found


WAYS = ways_in()


def misspelt(word):
    """A letter left out, two letters swapped, one doubled."""
    middle = len(word) // 2
    yield word[:middle] + word[middle + 1 :]
    yield word[: middle - 1] + word[middle] + word[middle - 1] + word[middle + 1 :]
    yield word[:middle] + word[middle] + word[middle:]


def document(way, attributes="", last=None):
    """A chart with one element, which lies in those that it must lie in."""
    *around, element = way
    inner = f"<{last or element} {attributes}/>"
    for tag in reversed(around):
        inner = f"<{tag}>{inner}</{tag}>"
    return inner.replace("<scxml", '<scxml xmlns="http://www.w3.org/2005/07/scxml" version="1.0"', 1)


def findings(text):
    with pytest.raises(MachineError) as caught:
        read_text(text)
    return caught.value.diagnostics


def test_every_element_of_the_standard_is_reached():
    assert WAYS.keys() == RULES.keys()


@pytest.mark.parametrize(
    ("element", "attribute"), [(tag, name) for tag, rule in RULES.items() for name in sorted(rule.attributes)]
)
def test_a_misspelt_attribute_is_named(element, attribute):
    known = RULES[element].attributes
    for wrong in set(misspelt(attribute)) - known:
        text = document(WAYS[element], f'{wrong}="a"')
        (one,) = [one for one in findings(text) if f"`{wrong}` of <{element}>" in one.message]
        assert one.suggestion.startswith("did you mean `") or (attribute == "id" and one.suggestion == "leave it out")


@pytest.mark.parametrize("element", [one for one in RULES if one != "scxml"])
def test_a_misspelt_element_is_named(element):
    for wrong in set(misspelt(element)) - RULES.keys():
        text = document(WAYS[element], last=wrong)
        assert any(f"<{wrong}>" in one.message for one in findings(text)), wrong


@pytest.mark.parametrize("element", RULES)
def test_an_attribute_without_a_value_is_named(element):
    for name in sorted(RULES[element].attributes - {"label", "version"}):
        text = document(WAYS[element], f'{name}=""')
        assert any(f"`{name}` of <{element}> is empty" in one.message for one in findings(text)), name


@pytest.mark.parametrize(
    ("body", "code", "words"),
    [
        ("<onentry><raise/></onentry>", "E0909", "<raise> needs `event`"),
        ('<onentry><if><raise event="x"/></if></onentry>', "E0909", "<if> needs `cond`"),
        ('<onentry><foreach array="[1]"/></onentry>', "E0909", "<foreach> needs `item`"),
        ('<onentry><send event="x" delay="5"/></onentry>', "E0910", "`5` is a delay without a unit"),
        ('<onentry><send event="x" delay="1 sec"/></onentry>', "E0910", "`1 sec` is not a delay"),
        ('<datamodel><data id="n"/></datamodel>', "E0907", "two pieces of data are called `n`"),
        ('<datamodel><data id="1n"/></datamodel>', "E0910", "`1n` is not a name for data"),
        ('<datamodel><data expr="1"/></datamodel>', "E0909", "<data> needs `id`"),
        ('<datamodel><data id="m" expr="1">5</data></datamodel>', "E0904", "exclude each other"),
        ('<onentry><assign expr="1"/></onentry>', "E0909", "<assign> needs `location`"),
        ('<onentry><if cond="true"><else/><elseif cond="true"/></if></onentry>', "E0903", "cannot follow <else>"),
    ],
)
def test_what_is_missing_in_a_chart_with_data_is_named(body, code, words):
    with pytest.raises(MachineError) as raised:
        read_text(
            '<scxml xmlns="http://www.w3.org/2005/07/scxml" version="1.0" datamodel="ecmascript">'
            f'<datamodel><data id="n" expr="1"/></datamodel><state id="a">{body}</state></scxml>'
        )
    assert [(one.code, words in one.message) for one in raised.value.diagnostics] == [(code, True)]


STATE = '<state id="a"><onentry>{}</onentry></state>'
SEND = STATE.format('<send event="x">{}</send>')


@pytest.mark.parametrize(
    ("body", "message"),
    [
        (STATE.format('<assign location="x"/>'), "<assign> needs `expr` or a value in it"),
        (SEND.format('<param name="p"/>'), "<param> needs `expr` or `location`"),
        (SEND.format('<content expr="1"/><content expr="2"/>'), "<send> has a second <content>"),
        (SEND.format('<param name="p" expr="1"/><content expr="1"/>'), "<param> and <content>, which exclude"),
        (SEND.format('<content expr="1">2</content>'), "<content> has `expr` and a value in it"),
        (STATE.format("<raise event='x'/>") + "<datamodel/><datamodel/>", "<scxml> has a second <datamodel>"),
        ('<final id="a"><donedata/><donedata/></final>', "<final> has a second <donedata>"),
        ('<history id="h"><transition target="a"/></history><state id="a"/>', "<scxml> cannot contain <history>"),
        ('<state id="a"><invoke src="http://x.org/a.scxml"/></state>', "it is not a file"),
        ('<state id="a"><invoke src="x" autoforward="yes"/></state>', "`autoforward` of <invoke> is `true` or `false`"),
        *(
            (f'<state id="a"><transition event="{event}" target="a"/></state>', f"`{wrong}` is not an event descriptor")
            for event, wrong in [("a, b", "a,"), ("a.*.b", "a.*.b"), ("a..b", "a..b"), ("a;b", "a;b"), ("x *a", "*a")]
        ),
        *(
            (f'<state id="a"><transition cond="{condition}" target="a"/></state>', "is not supported")
            for condition in ("x = 1", "x | 1", "[...x]", "0x10", "x?.y")
        ),
        (STATE.format('<assign location="x[0]" expr="1"/>'), "the location `x[0]` is not supported"),
    ],
)
def test_an_odd_combination_is_named(body, message):
    data = '<datamodel><data id="x"/></datamodel>' if "datamodel" not in body else ""
    text = f'<scxml xmlns="http://www.w3.org/2005/07/scxml" version="1.0" datamodel="ecmascript">{data}{body}</scxml>'
    assert message in "\n".join(one.message for one in findings(text))


@pytest.mark.parametrize("event", ["*", ".*", "a", "a.b", "a.", "a.*", "done.state.a b.c *", "error.execution"])
def test_event_descriptors_of_the_standard_are_read(event):
    text = document(("scxml", "state", "transition"), f'event="{event}" target="a"')
    read_text(text.replace("<state>", '<state id="a">'))


def test_executable_content_may_have_several_scripts():
    content = "<script>x = 1</script><script>x = 2</script>"
    body = STATE.format(f'{content}<if cond="true">{content}<else/>{content}</if>')
    data = '<datamodel><data id="x"/></datamodel>'
    read_text(
        f'<scxml xmlns="http://www.w3.org/2005/07/scxml" version="1.0" datamodel="ecmascript">{data}{body}</scxml>'
    )
