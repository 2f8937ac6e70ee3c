"""The tool that says where a script is slower: it times each call without those inside it."""

from __future__ import annotations

import pytest
from tools.compare_speed import Recorder, code_of

SCRIPT = """
def spin(turns, then=None):
    while turns:
        turns -= 1
    return then() if then else None

class A:
    def __init__(self):
        super().__init__()

A()
for _ in range(3):
    spin(100000, lambda: spin(400000))
"""


def test_a_call_is_timed_without_those_inside_it(tmp_path):
    path = tmp_path / "script.py"
    path.write_text(SCRIPT)
    recorder = Recorder()
    exec(code_of(path, recorder), {"__timed_call__": recorder.timed(), "__name__": "script"})
    found = {site.text: number for number, site in enumerate(recorder.sites)}
    assert recorder.counts[found["A()"]] == 1
    outer, inner = found["spin(100000, lambda: spin(400000))"], found["spin(400000)"]
    assert recorder.counts[outer] == recorder.counts[inner] == 3
    own_outer, whole_outer = recorder.rests[outer]
    own_inner, whole_inner = recorder.rests[inner]
    assert own_inner == whole_inner
    assert 2.0 * own_outer < own_inner  # four times as many turns
    assert whole_outer == pytest.approx(own_outer + own_inner, rel=0.05)  # and what calling costs
