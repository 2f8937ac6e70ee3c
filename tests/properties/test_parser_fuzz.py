"""Mutated model files: a clear error or a model, never a crash, a hang, or a half-filled plant."""

import logging
import os
import pathlib
import re
import sys
import time

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from sheldrake.multibody.parsing import ParseError, Parser
from sheldrake.multibody.plant import AddMultibodyPlantSceneGraph
from sheldrake.systems.framework import DiagramBuilder

MODELS = pathlib.Path(__file__).parents[1] / "models" / "parsing"
SEEDS = sorted(path for path in MODELS.iterdir() if path.suffix in (".urdf", ".sdf", ".xml", ".yaml"))
LIMIT = 2.0  # [s] for one small file

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


def load_seed(path):
    text = path.read_text()
    # Names resolve without a package, so that mutations reach further than the first file name.
    return (
        text.replace("package://parsing/", str(MODELS) + "/")
        .replace(">tetra.obj<", f">{MODELS}/tetra.obj<")
        .replace('"tetra.obj"', f'"{MODELS}/tetra.obj"')
    )


def kind_of(path):
    return "dmd.yaml" if path.name.endswith(".dmd.yaml") else path.suffix[1:]


def parse(text, kind):
    """Parses; checks the kind of error, the time, and that a failed parse leaves the plant alone."""
    builder = DiagramBuilder()
    plant, _ = AddMultibodyPlantSceneGraph(builder, 1e-3)
    before = plant.num_bodies(), plant.num_model_instances(), plant.num_frames(), plant.num_joints()
    start = time.process_time()
    try:
        instances = Parser(plant).AddModelsFromString(text, kind)
        assert all(plant.GetModelInstanceName(instance) for instance in instances)
    except ParseError as error:
        assert error.problem and error.location.source
        if kind != "dmd.yaml":  # directives are carried out one by one
            assert before == (plant.num_bodies(), plant.num_model_instances(), plant.num_frames(), plant.num_joints())
    except NotImplementedError as error:
        assert str(error)
    assert time.process_time() - start < LIMIT


@pytest.fixture(autouse=True)
def quiet():
    log = logging.getLogger("drake")
    level = log.level
    log.setLevel(logging.CRITICAL)
    yield
    log.setLevel(level)


def swap_values(draw, text):
    """Replaces one attribute value or element text."""
    spots = [match.span(1) for match in re.finditer(r'(?:="([^"]*)")', text)]
    spots += [match.span(1) for match in re.finditer(r">([^<>\n]+)<", text)]
    spots += [match.span(1) for match in re.finditer(r": ([^\n{\[]+)\n", text)]
    if not spots:
        return text
    start, end = draw(st.sampled_from(spots))
    return text[:start] + draw(st.sampled_from(VALUES)) + text[end:]


def drop_element(draw, text):
    """Removes one whole element or line."""
    spots = [match.span() for match in re.finditer(r"<([\w:]+)[^<>]*?/>|<([\w:]+)[^<>]*>[^<>]*</\2>|\n[^\n]+", text)]
    if not spots:
        return text
    start, end = draw(st.sampled_from(spots))
    return text[:start] + text[end:]


def repeat_element(draw, text):
    """Doubles one whole element or line."""
    spots = [match.span() for match in re.finditer(r"<([\w:]+)[^<>]*?/>|<([\w:]+)[^<>]*>[^<>]*</\2>|\n[^\n]+", text)]
    if not spots:
        return text
    start, end = draw(st.sampled_from(spots))
    return text[:end] + text[start:end] + text[end:]


def rename(draw, text):
    """Replaces one tag, attribute or key by another word of the file."""
    words = sorted(set(re.findall(r"[\w:]+", text)))
    if not words:
        return text
    old, new = draw(st.sampled_from(words)), draw(st.sampled_from(words))
    matches = [match.span() for match in re.finditer(rf"(?<![\w:]){re.escape(old)}(?![\w:])", text)]
    start, end = draw(st.sampled_from(matches))
    return text[:start] + new + text[end:]


def insert(draw, text):
    """Puts a piece of syntax somewhere."""
    at = draw(st.integers(0, len(text)))
    return text[:at] + draw(st.sampled_from(PIECES)) + text[at:]


def cut(draw, text):
    """Ends the file early."""
    return text[: draw(st.integers(0, len(text)))]


@st.composite
def mutated(draw, text):
    """A file after one to four mutations."""
    for _ in range(draw(st.integers(1, 4))):
        mutation = draw(st.sampled_from([swap_values, swap_values, drop_element, repeat_element, rename, insert, cut]))
        text = mutation(draw, text)
    return text


@pytest.mark.parametrize("path", SEEDS, ids=lambda path: path.name)
def test_mutated_files_give_models_or_clear_errors(path):
    seed, kind = load_seed(path), kind_of(path)

    @settings(
        max_examples=int(os.environ.get("SHELDRAKE_FUZZ_EXAMPLES", "60")),
        deadline=None,
        derandomize=True,
        suppress_health_check=list(HealthCheck),
        database=None,
    )
    @given(mutated(seed))
    def check(text):
        parse(text, kind)

    check()


@pytest.mark.parametrize("kind", ["urdf", "sdf", "xml", "dmd.yaml"])
def test_any_text_gives_a_clear_error(kind):
    @settings(max_examples=100, deadline=None, derandomize=True, database=None)
    @given(st.text(max_size=200))
    def check(text):
        parse(text, kind)

    check()


def test_large_flat_files_take_time_in_proportion():
    """Calls of Python per link: wall time would depend on the machine."""

    def calls(n):
        links = "".join(f'<link name="l{i}"/>' for i in range(n))
        joint = '<joint name="j{0}" type="fixed"><parent link="l{0}"/><child link="l{1}"/></joint>'
        joints = "".join(joint.format(i, i + 1) for i in range(n - 1))
        count = 0

        def trace(frame, event, argument):
            nonlocal count
            count += event == "call"

        sys.setprofile(trace)
        try:
            parse(f'<robot name="r">{links}{joints}</robot>', "urdf")
        finally:
            sys.setprofile(None)
        return count

    few, many = calls(50), calls(200)
    assert many < 4.5 * few
