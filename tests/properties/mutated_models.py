"""Model files with faults: mutations for hypothesis, and what every parse has to keep to."""

from __future__ import annotations

import os
import pathlib
import re
import time
from collections.abc import Iterator

from hypothesis import HealthCheck, settings
from hypothesis import strategies as st

from sheldrake.multibody.parsing import ParseError, Parser
from sheldrake.multibody.parsing._files.diagnostics import DiagnosticPolicy
from sheldrake.multibody.parsing._files.xml import parse_xml
from sheldrake.multibody.plant import AddMultibodyPlantSceneGraph
from sheldrake.systems.framework import DiagramBuilder

MODELS = pathlib.Path(__file__).parents[1] / "models" / "parsing"
LIMIT = 2.0  # [s] of processor time for one small file
VALUES = ["", " ", "nan", "inf", "-1", "0", "1e999", "1 2", "1 2 3", "x", "world", "a::b", "__model__", "&#0;", "true"]
PIECES = [
    "<",
    ">",
    '"',
    "<!--",
    "-->",
    "<![CDATA[",
    "]]>",
    "&lt;",
    "<a>",
    "</a>",
    "\x00",
    "é",
    "<!DOCTYPE a>",
    "{",
    "- [",
]
UNHEARD = "unheard_of"


def fuzz_settings(examples: int) -> settings:
    """The same examples in every run; SHELDRAKE_FUZZ_EXAMPLES asks for more of them."""
    return settings(
        max_examples=int(os.environ.get("SHELDRAKE_FUZZ_EXAMPLES", examples)),
        deadline=None,
        derandomize=True,
        suppress_health_check=list(HealthCheck),
        database=None,
    )


def make_parser() -> Parser:
    """A parser for a new plant with a scene graph; it knows the package of our own files."""
    plant, _ = AddMultibodyPlantSceneGraph(DiagramBuilder(), 1e-3)
    parser = Parser(plant)
    parser.package_map().Add("parsing", str(MODELS))
    return parser


def add_text(parser: Parser, path: pathlib.Path, text: str) -> list:
    """Adds a text as if it were what a file holds: names of other files are relative to that one."""
    return parser._add(parser._kind_of(str(path)), parser._reading_of(str(path)), text)


def check_parse(path: pathlib.Path, text: str) -> None:
    """Parses; checks the kind of error, the time, and that a failed parse leaves the plant alone."""
    parser = make_parser()
    plant = parser.plant()

    def counts() -> tuple[int, ...]:
        return plant.num_bodies(), plant.num_model_instances(), plant.num_frames(), plant.num_joints()

    before, start = counts(), time.process_time()
    try:
        instances = add_text(parser, path, text)
        assert all(plant.GetModelInstanceName(instance) for instance in instances)
    except ParseError as error:
        assert error.problem and error.location.source
        if not path.name.endswith(".dmd.yaml"):  # directives are carried out one by one
            assert before == counts()
    except NotImplementedError as error:
        assert str(error)
    assert time.process_time() - start < LIMIT


# --- mutations


def swap_values(draw, text: str) -> str:
    """Replaces one attribute value or element text."""
    spots = [match.span(1) for match in re.finditer(r'(?:="([^"]*)")', text)]
    spots += [match.span(1) for match in re.finditer(r">([^<>\n]+)<", text)]
    spots += [match.span(1) for match in re.finditer(r": ([^\n{\[]+)\n", text)]
    if not spots:
        return text
    start, end = draw(st.sampled_from(spots))
    return text[:start] + draw(st.sampled_from(VALUES)) + text[end:]


def whole_elements(text: str) -> list[tuple[int, int]]:
    """Where elements without children, and lines, begin and end."""
    pattern = r"<([\w:]+)[^<>]*?/>|<([\w:]+)[^<>]*>[^<>]*</\2>|\n[^\n]+"
    return [match.span() for match in re.finditer(pattern, text)]


def drop_element(draw, text: str) -> str:
    """Removes one whole element or line."""
    spots = whole_elements(text)
    if not spots:
        return text
    start, end = draw(st.sampled_from(spots))
    return text[:start] + text[end:]


def repeat_element(draw, text: str) -> str:
    """Doubles one whole element or line."""
    spots = whole_elements(text)
    if not spots:
        return text
    start, end = draw(st.sampled_from(spots))
    return text[:end] + text[start:end] + text[end:]


def rename(draw, text: str) -> str:
    """Replaces one tag, attribute or key by another word of the file."""
    words = sorted(set(re.findall(r"[\w:]+", text)))
    if not words:
        return text
    old, new = draw(st.sampled_from(words)), draw(st.sampled_from(words))
    matches = [match.span() for match in re.finditer(rf"(?<![\w:]){re.escape(old)}(?![\w:])", text)]
    start, end = draw(st.sampled_from(matches))
    return text[:start] + new + text[end:]


def insert(draw, text: str) -> str:
    """Puts a piece of syntax somewhere."""
    at = draw(st.integers(0, len(text)))
    return text[:at] + draw(st.sampled_from(PIECES)) + text[at:]


def cut(draw, text: str) -> str:
    """Ends the file early."""
    return text[: draw(st.integers(0, len(text)))]


@st.composite
def mutated(draw, text: str) -> str:
    """A file after one to four mutations."""
    for _ in range(draw(st.integers(1, 4))):
        mutation = draw(st.sampled_from([swap_values, swap_values, drop_element, repeat_element, rename, insert, cut]))
        text = mutation(draw, text)
    return text


# --- what no one reads


def unheard_of(path: pathlib.Path, silent: set[str]) -> Iterator[tuple[str, str]]:
    """XML files with an attribute, or a child, that means nothing.

    Each kind of place is visited once: the tags that lead there with their types.

    Args:
        path: The file.
        silent: Tags within which no one has to notice; nor within what a file itself says to ignore.

    Yields:
        The place, such as "robot/link +attribute", and the text.
    """
    root = parse_xml(path.read_bytes(), str(path), DiagnosticPolicy())
    data, visited, rest = root._source.data, set(), [(root, root.tag)]
    while rest:
        element, place = rest.pop()
        if element.tag in silent or "true" in (element.get("ignore"), element.get("drake_ignore")):
            continue
        rest += [(child, f"{place}/{child.tag}") for child in element]
        key = place, element.get("type"), element.get("class")
        if key in visited:
            continue
        visited.add(key)
        after_tag = element._offset + 1 + len(element.tag.encode())
        head, tail = data[:after_tag], data[after_tag:]
        yield f"{place} +attribute", (head + f' {UNHEARD}="1"'.encode() + tail).decode()
        attributes, close, inside = re.match(
            rb"((?:\"[^\"]*\"|'[^']*'|[^>\"'/]|/(?!>))*)(/?>)(.*)", tail, re.DOTALL
        ).groups()
        child = f"<{UNHEARD}/>" + (f"</{element.tag}>" if close == b"/>" else "")
        yield f"{place} +child", (head + attributes + b">" + child.encode() + inside).decode()


def messages(path: pathlib.Path, text: str) -> list[str]:
    """All that a parse says, its error last."""
    parser, heard = make_parser(), []
    parser.diagnostic_policy().SetActionForWarnings(lambda detail: heard.append(detail.message))
    try:
        add_text(parser, path, text)
    except (ParseError, NotImplementedError) as error:
        heard.append(f"error: {error}")
    return heard


def unnoticed_places(path: pathlib.Path, silent: set[str], visited: set[str]) -> list[str]:
    """The places of a file where nonsense is taken without a word; `visited` gets the places that were tried.

    Not within elements that the file itself makes the parser leave out with a message; none in a file with an error.
    """
    before = messages(path, path.read_text())
    if before and before[-1].startswith("error: "):
        return []
    left_out = {tag for message in before if "ignored" in message for tag in re.findall(r"<([\w:]+)>", message)[:1]}
    found = []
    for place, text in unheard_of(path, silent | left_out):
        if place not in visited and not any(UNHEARD in message for message in messages(path, text)):
            found.append(f"{path.name}: {place}")
        visited.add(place)
    return found
