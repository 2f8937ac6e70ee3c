"""Model files with faults: mutations of what there is, files made by a grammar, and what every parse has to keep to.

Chance is a `random.Random`: one of a seed in campaigns, one that hypothesis shrinks in tests (`mutated`).
"""

from __future__ import annotations

import html
import os
import pathlib
import random
import re
import time
from collections import defaultdict
from collections.abc import Iterable, Iterator

import numpy as np
from hypothesis import HealthCheck, settings
from hypothesis import strategies as st

import sheldrake
from sheldrake.multibody.parsing import ParseError, Parser
from sheldrake.multibody.parsing._files.diagnostics import DiagnosticPolicy
from sheldrake.multibody.parsing._files.xml import parse_xml
from sheldrake.multibody.plant import AddMultibodyPlantSceneGraph, MultibodyPlant
from sheldrake.systems.analysis import Simulator
from sheldrake.systems.framework import DiagramBuilder

BUNDLED = pathlib.Path(sheldrake.__file__).parent / "models"
MODELS = pathlib.Path(__file__).parents[2] / "tests" / "models" / "parsing"
SEEDS = sorted(
    path for path in (*MODELS.iterdir(), *BUNDLED.rglob("*")) if path.suffix in (".urdf", ".sdf", ".xml", ".yaml")
)
WHOLE = [path for path in SEEDS if path.suffix != ".yaml" and path.name != "chain_part.xml"]  # a part of chain.xml
SILENT = {"gazebo", "hardwareInterface", "include"}
"""Of what we have in our files: for other programs, or replaced by what it names."""
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


def make_parser(builder: DiagramBuilder | None = None) -> Parser:
    """A parser for a new plant with a scene graph; it knows the package of our own files."""
    plant, _ = AddMultibodyPlantSceneGraph(builder or DiagramBuilder(), 1e-3)
    parser = Parser(plant)
    parser.package_map().Add("parsing", str(MODELS))
    return parser


def add_text(parser: Parser, path: pathlib.Path, text: str) -> list:
    """Adds a text as if it were what a file holds: names of other files are relative to that one."""
    return parser._add(parser._kind_of(str(path)), parser._reading_of(str(path)), text)


def check_parse(path: pathlib.Path, text: str, steps: bool = False) -> None:
    """Parses; checks the kind of error, the time, and that a failed parse leaves the plant alone.

    Args:
        path: Where the text seems to be.
        text: Of the file.
        steps: What was parsed is also finalized and stepped.
    """
    builder = DiagramBuilder()
    parser = make_parser(builder)
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
    else:
        if steps:
            check_steps(builder, plant)
            return
    assert time.process_time() - start < LIMIT


def check_steps(builder: DiagramBuilder, plant: MultibodyPlant) -> None:
    """Two steps of a model: its state stays finite, or an error says what is wrong with the model."""
    try:
        plant.Finalize()
        diagram = builder.Build()
        simulator = Simulator(diagram)
        simulator.AdvanceTo(2e-3)
    except (RuntimeError, ValueError, NotImplementedError) as error:
        assert str(error)
    else:
        state = plant.GetMyContextFromRoot(simulator.get_context()).get_discrete_state_vector().value()
        assert np.all(np.isfinite(state))


# --- mutations


def swap_values(chance: random.Random, text: str) -> str:
    """Replaces one attribute value or element text."""
    spots = [match.span(1) for match in re.finditer(r'(?:="([^"]*)")', text)]
    spots += [match.span(1) for match in re.finditer(r">([^<>\n]+)<", text)]
    spots += [match.span(1) for match in re.finditer(r": ([^\n{\[]+)\n", text)]
    if not spots:
        return text
    start, end = chance.choice(spots)
    return text[:start] + chance.choice(VALUES) + text[end:]


def whole_elements(text: str) -> list[tuple[int, int]]:
    """Where elements without children, and lines, begin and end."""
    pattern = r"<([\w:]+)[^<>]*?/>|<([\w:]+)[^<>]*>[^<>]*</\2>|\n[^\n]+"
    return [match.span() for match in re.finditer(pattern, text)]


def drop_element(chance: random.Random, text: str) -> str:
    """Removes one whole element or line."""
    spots = whole_elements(text)
    if not spots:
        return text
    start, end = chance.choice(spots)
    return text[:start] + text[end:]


def repeat_element(chance: random.Random, text: str) -> str:
    """Doubles one whole element or line."""
    spots = whole_elements(text)
    if not spots:
        return text
    start, end = chance.choice(spots)
    return text[:end] + text[start:end] + text[end:]


def rename(chance: random.Random, text: str) -> str:
    """Replaces one tag, attribute or key by another word of the file."""
    words = sorted(set(re.findall(r"[\w:]+", text)))
    if not words:
        return text
    old, new = chance.choice(words), chance.choice(words)
    matches = [match.span() for match in re.finditer(rf"(?<![\w:]){re.escape(old)}(?![\w:])", text)]
    start, end = chance.choice(matches)
    return text[:start] + new + text[end:]


def insert(chance: random.Random, text: str) -> str:
    """Puts a piece of syntax somewhere."""
    at = chance.randint(0, len(text))
    return text[:at] + chance.choice(PIECES) + text[at:]


def cut(chance: random.Random, text: str) -> str:
    """Ends the file early."""
    return text[: chance.randint(0, len(text))]


MUTATIONS = (swap_values, swap_values, drop_element, repeat_element, rename, insert, cut)


def mutate(chance: random.Random, text: str) -> str:
    """A file after one to four mutations."""
    for _ in range(chance.randint(1, 4)):
        text = chance.choice(MUTATIONS)(chance, text)
    return text


def mutated(text: str) -> st.SearchStrategy[str]:
    """The same for hypothesis."""
    return st.randoms(use_true_random=False).map(lambda chance: mutate(chance, text))


# --- files by a grammar


class Grammar:
    """What stands in what, as some files of one format have it; documents that no one has written are made of that.

    Args:
        texts: Files of one format of XML.
    """

    MOST = 80  # elements

    def __init__(self, texts: Iterable[str]) -> None:
        self.roots: list[str] = []
        self.children: dict[str, list[list[str]]] = defaultdict(list)
        self.attributes: dict[str, dict[str, list[str]]] = defaultdict(lambda: defaultdict(list))
        self.contents: dict[str, list[str]] = defaultdict(list)
        rest = [parse_xml(text.encode(), "seed", DiagnosticPolicy()) for text in texts]
        self.roots += [root.tag for root in rest]
        while rest:
            element = rest.pop()
            rest += element.children
            self.children[element.tag].append([child.tag for child in element])
            self.contents[element.tag].append(element.text.strip())
            for name, value in element.attributes.items():
                self.attributes[element.tag][name].append(value)

    def document(self, chance: random.Random) -> str:
        """A file: elements where they may be, with values that some element of that name has, or a strange one."""
        self.left = self.MOST
        return self._element(chance, chance.choice(self.roots), 0)

    def _element(self, chance: random.Random, tag: str, depth: int) -> str:
        self.left -= 1
        attributes = "".join(
            f' {name}="{self._value(chance, values)}"'
            for name, values in self.attributes[tag].items()
            if chance.random() < 0.85
        )
        inside = self._value(chance, self.contents[tag])
        if depth < 20:
            for child in chance.choice(self.children[tag]) + chance.choice(self.children[tag]):
                if self.left > 0 and chance.random() < 0.7:
                    inside += self._element(chance, child, depth + 1)
        return f"<{tag}{attributes}>{inside}</{tag}>"

    @staticmethod
    def _value(chance: random.Random, values: list[str]) -> str:
        return chance.choice(VALUES) if chance.random() < 0.05 else html.escape(chance.choice(values))


def expand(chance: random.Random, rules: dict[str, list[str]], symbol: str, room: int = 200) -> str:
    """A text by rules: `$name` and `${name}` stand for one alternative of `name`, the first once room is short."""
    found, stack = [], [f"${symbol}"]
    while stack:
        before, mark, after = stack.pop().partition("$")
        found.append(before)
        if mark:
            name = re.match(r"\{(\w+)\}|(\w+)", after)
            choices = rules[name[1] or name[2]]
            room -= 1
            stack += [after[name.end() :], chance.choice(choices) if room > 0 else choices[0]]
    return "".join(found)


DIRECTIVES = {
    "directives": ["directives:\n$one$more"],
    "more": ["", "$one$more", "$one$more", "$one$more"],
    "one": [
        "- add_model_instance: {name: $new}\n",
        "- add_model:\n    file: $file\n    name: $new\n$positions",
        "- add_weld: {parent: $frame, child: $frame$X_PC}\n",
        "- add_frame:\n    name: $new\n    X_PF: {base_frame: $frame, $pose}\n",
        "- add_directives: {file: $file}\n",
        "- add_collision_filter_group: {name: $new, members: [$frame, $frame], ignored_collision_filter_groups: "
        "[$new]}\n",
    ],
    "file": ["package://parsing/part.dmd.yaml", "package://parsing/arm.sdf", "package://parsing/gripper.sdf",
             "package://parsing/chain.xml", "package://parsing/none.urdf", "package://x/y.urdf", "''", "3"],
    "new": ["a", "b", "a::b", "arm", "gripper", "world", "''", "1", "null"],
    "frame": ["world", "arm::base", "arm::link", "gripper::base", "a::base", "b", "a", "::", "''", "null"],
    "positions": ["", "    default_joint_positions: {$joint: [$number]}\n",
                  "    default_free_body_pose: {$new: {$pose}}\n"],
    "joint": ["elbow", "shoulder", "slide", "x"],
    "X_PC": ["", ", X_PC: {$pose}"],
    "pose": ["translation: [$number, $number, $number]", "rotation: !Rpy {deg: [$number, $number, $number]}",
             "rotation: !AngleAxis {angle_deg: $number, axis: [$number, 0, 1]}", "rotation: !Uniform {}",
             "translation: $number"],
    "number": ["0", "1", "-1.5", "1e9", ".inf", ".nan", "x", "!Uniform {min: 0, max: 1}"],
}  # fmt: skip

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


def left_out(heard: list[str]) -> set[str]:
    """Tags that a parse said it ignored."""
    return {tag for message in heard if "ignored" in message for tag in re.findall(r"<([\w:]+)>", message)[:1]}


def unnoticed_places(path: pathlib.Path, silent: set[str], visited: set[str]) -> list[str]:
    """The places of a file where nonsense is taken without a word; `visited` gets the places that were tried.

    Not within elements that the file itself makes the parser leave out with a message; none in a file with an error.
    """
    before = messages(path, path.read_text())
    if before and before[-1].startswith("error: "):
        return []
    found = []
    for place, text in unheard_of(path, silent | left_out(before)):
        if place not in visited and not any(UNHEARD in message for message in messages(path, text)):
            found.append(f"{path.name}: {place}")
        visited.add(place)
    return found
