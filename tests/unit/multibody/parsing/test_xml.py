"""The XML reader: positions, lenient corners, refusals."""

import re

import numpy as np
import pytest

from sheldrake.multibody.parsing._files.diagnostics import DiagnosticPolicy, ParseError
from sheldrake.multibody.parsing._files.xml import MAX_DEPTH, parse_xml, read_xml


def parse(text):
    return parse_xml(text, "robot.urdf", DiagnosticPolicy())


def test_every_element_and_attribute_knows_its_line_and_column():
    root = parse('<robot\n   name="r">\n  <link name="a"/> <link\n    kind="x" name="b"/>\n</robot>')
    first, second = root.find_all("link")
    assert (root.line, root.column) == (1, 1)
    assert root.where_attribute("name")[1:] == (2, 4)
    assert (first.line, first.column) == (3, 3)
    assert first.where_attribute("name")[1:] == (3, 9)
    assert (second.line, second.column) == (3, 20)
    assert second.where_attribute("kind")[1:] == (4, 5)
    assert second.where_attribute("name")[1:] == (4, 14)
    assert second.where_attribute("absent") == second.where
    assert str(second.where) == "robot.urdf:3:20"


def test_an_attribute_is_not_mistaken_for_the_text_of_another():
    root = parse('<robot note="a > b, name = 1"\n\n  \tname = \'r\' xname="s"/>')
    assert root.where_attribute("note")[1:] == (1, 8)
    assert root.where_attribute("name")[1:] == (3, 4)
    assert root.where_attribute("xname")[1:] == (3, 15)


def test_places_of_very_many_attributes_are_found():
    """In one pass: one for each would take minutes."""
    words = [f'b{k}="1"' for k in range(100_000)]
    element = parse(f"<a {' '.join(words)}/>")
    columns = np.cumsum([4] + [len(word) + 1 for word in words[:-1]])
    np.testing.assert_array_equal([element.where_attribute(name)[2] for name in element.attributes], columns)


def test_text_children_and_attributes_are_kept_in_order():
    root = parse("<a x='1' y='2'>one<b/>two<c><d/></c></a>")
    assert list(root.attributes.items()) == [("x", "1"), ("y", "2")]
    assert root.text == "onetwo"
    assert [child.tag for child in root] == ["b", "c"]
    assert root.find("c").find("d").tag == "d"
    assert root.find("nope") is None and root.get("nope", "?") == "?"


def test_undeclared_prefixes_are_part_of_the_name():
    assert parse('<robot><drake:joint drake:acceleration="1"/></robot>').children[0].tag == "drake:joint"


def test_white_space_before_the_declaration_is_accepted_and_counted():
    root = parse('\n\n  <?xml version="1.0" encoding="latin-1"?>\n<robot/>')
    assert root.line == 4


def test_double_hyphens_in_comments_are_accepted_and_keep_positions():
    root = parse("<a><!-- one -- two\n --- --><b/></a>")
    assert root.children[0].where[1:] == (2, 9)
    assert parse("<a><![CDATA[<!-- kept -->]]></a>").text == "<!-- kept -->"


def test_bytes_may_carry_their_encoding():
    data = "<?xml version='1.0' encoding='latin-1'?><a name='ü'/>".encode("latin-1")
    assert parse_xml(data, "x", DiagnosticPolicy()).get("name") == "ü"
    assert parse_xml("<a name='ü'/>".encode("utf-16"), "x", DiagnosticPolicy()).get("name") == "ü"


@pytest.mark.parametrize(
    ("text", "message", "line"),
    [
        ("", "empty|no element", 1),
        ("<a>\n<b>\n</a>", "mismatched tag; the innermost open element is the <b> of line 2", 3),
        ("<a>\n<b/>\n", "no element found; the innermost open element is the <a> of line 1", 3),
        ("<a", "well-formed", 1),
        ("<a/>\ntext", "junk after document element; the document ended with </a> before this", 2),
        ("<a x=1/>", "invalid token at '1/>'; a model is one element", 1),
        ('{"a": 1}', r"\(invalid token\); a model is one element, such as <robot> or <sdf>", 1),
        ("<a x='1' x='2'/>", "duplicate attribute", 1),
        ('<!DOCTYPE a [\n<!ENTITY e "text">]><a>&e;</a>', "entity 'e'", 2),
        ('<!DOCTYPE a [<!ENTITY e SYSTEM "file:///etc/passwd">]><a>&e;</a>', "entity 'e'", 1),
        ('<!DOCTYPE a SYSTEM "http://example.org/a.dtd"><a/>', "external definition", 1),
        ("<a>" * (MAX_DEPTH + 1), "nested deeper", 1),
    ],
)
def test_bad_text_is_refused_with_its_place(text, message, line):
    with pytest.raises(ParseError, match=message) as caught:
        parse(text)
    assert caught.value.location.source == "robot.urdf"
    assert caught.value.location.line in (line, 0)
    assert isinstance(caught.value, RuntimeError)


@pytest.mark.parametrize(
    ("text", "warning"),
    [
        ("<a><b c='1 & 2'/>x &nbsp; y</a>\n<a/>", "2:1: warning: .* what follows the root element is ignored"),
        ("<a><b c='1 & 2'/>x &nbsp; y</a></a>", "1:32: warning: .* what follows the root element is ignored"),
        ("<a><b c='1 & 2'/>x &nbsp; y</a>", "1:12: warning: .*'&' begins no character reference"),
        ("hello <a><b c='1 &amp; 2'/>x &amp;nbsp; y</a>", "1:1: warning: .* text before the root"),
        (
            "<?xml version='1.0'?>\n<?xml version='1.0'?><a><b c='1 &amp; 2'/>x &amp;nbsp; y</a>",
            "2:1: warning: .* not the first",
        ),
        ("<?xml version=1.0?>\n<a><b c='1 &amp; 2'/>x &amp;nbsp; y</a>", "1:1: warning: .* declaration is malformed"),
        ("<a d='1'e='2'><b c='1 &amp; 2'/>x &amp;nbsp; y</a>", "1:9: warning: .* a space is missing"),
        ("<a d='<'><b c='1 &amp; 2'/>x &amp;nbsp; y</a>", "1:7: warning: .* '<' in a value"),
        ("<a><b c='1 &amp; 2'/>\x01x &amp;nbsp; y</a>", "1:22: warning: .* a control character"),
    ],
)
def test_what_drake_reads_is_read_with_a_warning(text, warning):
    policy, seen = DiagnosticPolicy(), []
    policy.SetActionForWarnings(lambda detail: seen.append(detail.FormatWarning()))
    root = parse_xml(text, "robot.urdf", policy)
    assert root.find("b").get("c") == "1 & 2" and root.text == "x &nbsp; y"
    assert any(re.match("robot.urdf:" + warning, found) for found in seen)


@pytest.mark.parametrize("text", ["<a " * 10**5, "<![CDATA[" * 10**5, "<a x='" * 10**5, "<a>&" * 10**5, "&" * 10**6])
def test_what_cannot_be_mended_is_refused_quickly(text):
    with pytest.raises(ParseError, match=r"well-formed|nested"):
        parse(text)


def test_nested_entities_never_expand():
    entities = "".join(f'<!ENTITY e{i} "&e{i - 1};&e{i - 1};">' for i in range(1, 60))
    with pytest.raises(ParseError, match="entity 'e0'"):
        parse(f'<!DOCTYPE a [<!ENTITY e0 "x">{entities}]><a>&e59;</a>')


def test_depth_of_a_hundred_thousand_is_refused_quickly():
    with pytest.raises(ParseError, match="nested deeper"):
        parse("<a>" * 100_000 + "</a>" * 100_000)


def test_a_missing_file_is_named():
    with pytest.raises(ParseError, match=r"/nope/robot\.urdf: error: The file cannot be read: No such file"):
        read_xml("/nope/robot.urdf", DiagnosticPolicy())


def test_policies_see_warnings_and_errors():
    policy, seen = DiagnosticPolicy(), []
    policy.SetActionForWarnings(lambda detail: seen.append(detail.FormatWarning()))
    policy.SetActionForErrors(lambda detail: seen.append(detail.FormatError()))
    element = parse("<a/>")
    policy.Warning(element, "odd")
    with pytest.raises(ParseError):
        policy.Error(element, "wrong")
    policy.warnings_are_errors = True
    with pytest.raises(ParseError, match="odd"):
        policy.Warning(element, "odd")
    assert seen[:2] == ["robot.urdf:1:1: warning: odd", "robot.urdf:1:1: error: wrong"]
