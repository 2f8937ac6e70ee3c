"""The tool that says where a script is slower: it times each call without those inside it."""

from __future__ import annotations

from tools.compare_speed import Recorder, code_of

SCRIPT = """
def spin(turns, then=None):
    clock[0] += turns
    return then() if then else None

class A:
    def __init__(self):
        super().__init__()

A()
for _ in range(3):
    spin(100000, lambda: spin(400000))
"""


def test_a_call_is_timed_without_those_inside_it(tmp_path, monkeypatch):
    """By a clock that only turns move."""
    clock = [0.0]
    monkeypatch.setattr("time.process_time", lambda: clock[0])
    path = tmp_path / "script.py"
    path.write_text(SCRIPT)
    recorder = Recorder()
    names = {"__timed_call__": recorder.timed(), "__name__": "script", "clock": clock}
    exec(code_of(path, recorder), names)
    found = {site.text: number for number, site in enumerate(recorder.sites)}
    assert recorder.counts[found["A()"]] == 1
    outer, inner = found["spin(100000, lambda: spin(400000))"], found["spin(400000)"]
    assert recorder.counts[outer] == recorder.counts[inner] == 3
    assert recorder.firsts[outer] == [1e5, 5e5, 5e5]
    assert recorder.rests[outer] == [2e5, 1e6]  # of the second and third call
    assert recorder.rests[inner] == [8e5, 8e5]
