"""The map of a step in ARCHITECTURE.md is what runs, and tells what is written from what is read."""

import pytest
from tools import map_of_the_step as map_

from sheldrake.common.kernel import kernel


@kernel
def _scale(rows, factor):
    for k in range(len(rows)):
        rows[k].weight *= factor


@kernel
def _through(step, a, b):
    step(a.rows, b)


@kernel
def _by_names(model, work, out):
    last = work.table[0]
    last.count = 1
    for place in out:
        place[0] = model.x
    _through(_scale, work, 2.0)


def test_what_is_written_is_found():
    assert map_.written(_scale) == {"rows"}
    assert map_.written(_by_names) == {"work.table", "work.rows", "out"}


def test_what_is_called_is_found():
    assert set(map_.reached([_by_names])) == {_by_names, _through, _scale}


def test_the_map_is_true():
    page = map_.PAGE.read_text(encoding="utf-8")
    kept = page.partition(map_.BEGIN)[2].partition(map_.END)[0].strip()
    if kept != map_.text():
        pytest.fail("ARCHITECTURE.md shows another step: python tools/map_of_the_step.py --write")
