"""Model files through our parser and our plant: the same names, limits and dynamics as Drake has.

With the package example-robot-data beside Drake (`python dev.py robots`), its robots are compared too.
"""

import pathlib

import numpy as np
import pytest

pydrake = pytest.importorskip("pydrake")
pytestmark = [pytest.mark.peer, pytest.mark.usefixtures("quiet")]

from plant_numbers import MODELS, forward_dynamics, load, names, numbers, worst  # noqa: E402
from real_robots import robot_files  # noqa: E402

from sheldrake.multibody.parsing import ParseError  # noqa: E402

SHARE = pathlib.Path(pydrake.__file__).parent / "share" / "drake"
# Recursions add in different orders; the worst of all files and states is 1e-13 of the largest entry.
TOLERANCE = 1e-12


def files():
    own = sorted(
        path
        for path in MODELS.iterdir()
        if path.suffix in (".urdf", ".sdf", ".xml", ".obj") and "part" not in path.name
    )
    drakes = sorted(path for kind in ("urdf", "sdf") for path in SHARE.rglob(f"*.{kind}"))
    return [*own, *drakes, *robot_files("urdf", "sdf")]


def check_what_drake_refuses(path):
    """We read it, and it makes a sound plant, or say what is wrong."""
    try:
        ours = load("sheldrake", path, 1e-3)
    except ParseError as error:
        assert error.location.source == str(path) and error.location.line > 0
        return
    assert all(np.all(np.isfinite(value)) for name, value in numbers(ours).items() if "limits" not in name)


def loads(path, time_step):
    """Drake's plant, None when it refuses the file."""
    try:
        return load("pydrake", path, time_step)
    except RuntimeError:
        return None


@pytest.mark.parametrize("path", files(), ids=lambda path: path.name)
def test_names_limits_and_dynamics_equal_drakes(path):
    theirs = loads(path, 1e-3)
    if theirs is None:
        check_what_drake_refuses(path)
        return
    ours = load("sheldrake", path, 1e-3)
    assert names(ours) == names(theirs)
    name, error = worst(numbers(theirs), numbers(ours))
    assert error < TOLERANCE, name


@pytest.mark.parametrize("path", files(), ids=lambda path: path.name)
def test_forward_dynamics_equal_drakes(path):
    theirs = loads(path, 0.0)
    if theirs is None or theirs.num_velocities() == 0:
        return
    try:
        expectations = forward_dynamics(theirs)
    except RuntimeError as error:  # couplers, bodies without mass at the end of a chain
        assert "constraints" in str(error) or "mass" in str(error)
        return
    for (expected, bound), (found, _) in zip(expectations, forward_dynamics(load("sheldrake", path, 0.0))):
        scale = max(1.0, float(np.abs(expected).max()))
        np.testing.assert_allclose(found, expected, rtol=0, atol=max(1e-9, bound) * scale)


def test_a_fault_of_one_part_in_a_hundred_million_is_seen(tmp_path):
    text = (MODELS / "old.sdf").read_text()
    inertial = '<link name="a"><inertial><mass>{}</mass></inertial>'
    paths = []
    for name, mass in (("right", 2.0), ("wrong", 2.0 * (1.0 + 1e-8))):
        path = tmp_path / f"{name}.sdf"
        path.write_text(text.replace('<link name="a">', inertial.format(repr(mass))))
        paths.append(path)
    theirs, ours = numbers(load("pydrake", paths[0], 1e-3)), numbers(load("sheldrake", paths[1], 1e-3))
    assert worst(theirs, ours)[1] > 1e-9
    for quantity in ("mass matrix", "gravity", "inverse dynamics", "centre of mass"):
        part = {name: value for name, value in theirs.items() if name.startswith(f"{quantity}, state")}
        assert len(part) == 20
        assert worst(part, {name: ours[name] for name in part})[1] > 1e-10, quantity


def test_every_public_name_of_pydrakes_module_is_here():
    import pydrake.multibody.parsing as theirs

    import sheldrake.multibody.parsing as ours

    missing = [name for name in dir(theirs) if not name.startswith("_") and name not in ours.__all__]
    assert missing == []
    for name in ours.__all__:
        for member in dir(getattr(theirs, name, object)):
            known = [field.name for field in getattr(getattr(ours, name), "__fields__", ())]
            assert member.startswith("_") or member in known or hasattr(getattr(ours, name), member), (name, member)
