"""What does not take None in pydrake is a TypeError here too."""

from __future__ import annotations

import inspect
import json
import pathlib
import subprocess
import sys

import pytest

pytest.importorskip("pydrake")

from none_calls import objects, outcome

pytestmark = [pytest.mark.peer, pytest.mark.slow]

QUICK = set(
    "get_input_port get_output_port CalcTimeDerivatives SetTime Eval CalcPoseInBodyFrame CalcRotationMatrixInBodyFrame "
    "col row is_locked".split()
)
"""Calls that have to be quick, and so are not checked; those below have None for a default, or are not there."""


@pytest.fixture(scope="module")
def refused(tmp_path_factory):
    """Calls with None that are a TypeError in pydrake."""
    out = tmp_path_factory.mktemp("none") / "calls.json"
    script = pathlib.Path(__file__).with_name("none_calls.py")
    subprocess.run([sys.executable, str(script), str(out)], check=True, capture_output=True)
    return json.loads(out.read_text())


def is_bound_to_differ(thing, method, found):
    if method in QUICK or method.startswith("Do") or found == "NotImplementedError":
        return True
    parameters = list(inspect.signature(getattr(thing, method)).parameters.values())
    return bool(parameters) and parameters[0].default is not inspect.Parameter.empty


def wrong(refused):
    ours, found = objects("sheldrake"), []
    for name, method, n in refused:
        if not hasattr(ours[name], method):
            continue
        result = outcome(ours[name], method, n)
        if result != "TypeError" and not is_bound_to_differ(ours[name], method, result):
            found.append(f"{name}.{method}({n} None): {result}")
    return found


def test_none_is_refused(refused):
    assert len(refused) > 1500
    assert not wrong(refused)


def test_a_call_that_takes_it_is_found(refused, monkeypatch):
    from sheldrake.symbolic import Variables

    monkeypatch.setattr(Variables, "include", Variables.include.__wrapped__)
    assert wrong([call for call in refused if call[0] == "vars"])


def test_checked_calls_keep_their_signature():
    from sheldrake.geometry import GeometryProperties, ProximityProperties

    assert list(inspect.signature(GeometryProperties.HasProperty).parameters)[1:] == ["group_name", "name"]
    with pytest.raises(TypeError, match=r"HasProperty.*group_name must be str, not None"):
        GeometryProperties.HasProperty(ProximityProperties(), group_name=None, name="a")
