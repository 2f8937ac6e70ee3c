"""Mutated model files: a clear error or a model, never a crash, a hang, a half-filled plant, or a silent drop."""

from __future__ import annotations

import pathlib
import sys

import pytest
from hypothesis import given
from hypothesis import strategies as st
from tools.torture.documents import (
    MODELS,
    SEEDS,
    SILENT,
    WHOLE,
    check_parse,
    fuzz_settings,
    make_parser,
    mutated,
    unnoticed_places,
)

pytestmark = pytest.mark.usefixtures("quiet")


@pytest.mark.parametrize("path", SEEDS, ids=lambda path: path.name)
def test_mutated_files_give_models_or_clear_errors(path):
    @fuzz_settings(60)
    @given(mutated(path.read_text()))
    def check(text):
        check_parse(path, text)

    check()


@pytest.mark.parametrize("kind", ["urdf", "sdf", "xml", "dmd.yaml"])
def test_any_text_gives_a_clear_error(kind):
    @fuzz_settings(100)
    @given(st.text(max_size=200))
    def check(text):
        check_parse(pathlib.Path(f"any.{kind}"), text)

    check()


@pytest.mark.parametrize("path", WHOLE, ids=lambda path: path.name)
def test_nothing_is_dropped_silently(path):
    visited: set[str] = set()
    assert unnoticed_places(path, SILENT, visited) == []
    assert len(visited) > 10


def test_large_flat_files_take_time_in_proportion():
    """Calls of Python per link: wall time would depend on the machine."""

    def calls(n):
        links = "".join(f'<link name="l{i}"/>' for i in range(n))
        joint = '<joint name="j{0}" type="fixed"><parent link="l{0}"/><child link="l{1}"/></joint>'
        joints = "".join(joint.format(i, i + 1) for i in range(n - 1))
        parser, count = make_parser(), 0

        def trace(frame, event, argument):
            nonlocal count
            count += event == "call"

        sys.setprofile(trace)
        try:
            parser.AddModelsFromString(f'<robot name="r">{links}{joints}</robot>', "urdf")
        finally:
            sys.setprofile(None)
        return count

    few, many = calls(50), calls(200)
    assert many < 4.5 * few


def test_a_reader_that_forgets_to_look_is_found_out(monkeypatch):
    from sheldrake.multibody.parsing._reading.reading import Reading

    monkeypatch.setattr(Reading, "warn_unchecked", lambda self: None)
    assert unnoticed_places(MODELS / "arm.sdf", SILENT, set())
