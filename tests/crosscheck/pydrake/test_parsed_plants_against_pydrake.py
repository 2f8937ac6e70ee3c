"""Model files through our parser and our plant: the same names, limits and dynamics as Drake has."""

import logging
import os
import pathlib

import numpy as np
import pytest

pydrake = pytest.importorskip("pydrake")
pytestmark = pytest.mark.peer

from pydrake.multibody.parsing import Parser as TheirParser  # noqa: E402
from pydrake.multibody.plant import MultibodyPlant as TheirPlant  # noqa: E402

from sheldrake.multibody.parsing import ParseError, Parser  # noqa: E402
from sheldrake.multibody.plant import MultibodyPlant  # noqa: E402

HERE = pathlib.Path(__file__).parent
MODELS = HERE.parents[1] / "models" / "parsing"
SHARE = pathlib.Path(pydrake.__file__).parent / "share" / "drake"
# Recursions add in different orders; the worst of 90 robots and 3 states each is 2e-14 of the largest entry.
TOLERANCE = 1e-12


def files():
    own = sorted(
        path
        for path in MODELS.iterdir()
        if path.suffix in (".urdf", ".sdf", ".xml", ".obj") and "part" not in path.name
    )
    found = [*own, *sorted(path for kind in ("urdf", "sdf") for path in SHARE.rglob(f"*.{kind}"))]
    more = os.environ.get("SHELDRAKE_ROBOTS")  # a folder of further robots, for example example-robot-data's
    return found + (sorted(pathlib.Path(more).rglob("*.urdf")) if more else [])


def load(plant, parser_class, path):
    parser = parser_class(plant)
    parser.package_map().Add("parsing", str(MODELS))
    parser.AddModels(str(path))
    plant.Finalize()
    return plant


def numbers(plant, states=3):
    """Everything compared, by name."""
    context = plant.CreateDefaultContext()
    result = {
        "default positions": plant.GetPositions(context).copy(),
        "position limits": np.array([plant.GetPositionLowerLimits(), plant.GetPositionUpperLimits()]),
        "velocity limits": np.array([plant.GetVelocityLowerLimits(), plant.GetVelocityUpperLimits()]),
        "acceleration limits": np.array([plant.GetAccelerationLowerLimits(), plant.GetAccelerationUpperLimits()]),
        "effort limits": np.array([plant.GetEffortLowerLimits(), plant.GetEffortUpperLimits()]),
        "mass": np.array([plant.CalcTotalMass(context)]),
    }
    rng = np.random.default_rng(3)
    for state in range(states if plant.num_velocities() else 0):
        plant.SetPositions(context, rng.normal(size=plant.num_positions()))
        plant.SetVelocities(context, rng.normal(size=plant.num_velocities()))
        result[f"mass matrix {state}"] = plant.CalcMassMatrixViaInverseDynamics(context)
        result[f"bias {state}"] = plant.CalcBiasTerm(context)
        result[f"gravity {state}"] = plant.CalcGravityGeneralizedForces(context)
    return result


def names(plant):
    return [*plant.GetPositionNames(), *plant.GetVelocityNames(), *plant.GetActuatorNames()]


def worst(theirs, ours):
    """The quantity that differs most, and by how much relative to its largest entry."""
    errors = {"(nothing)": 0.0}
    for name, expected in theirs.items():
        finite = np.isfinite(expected)
        assert np.array_equal(np.where(finite, 0.0, expected), np.where(np.isfinite(ours[name]), 0.0, ours[name])), name
        scale = max(1.0, np.max(np.abs(expected[finite]), initial=0.0))
        errors[name] = np.max(np.abs(expected[finite] - ours[name][finite]), initial=0.0) / scale
    name = max(errors, key=errors.__getitem__)
    return name, errors[name]


def check_what_drake_refuses(path):
    """We read it, and it makes a sound plant, or say what is wrong."""
    try:
        ours = load(MultibodyPlant(1e-3), Parser, path)
    except ParseError as error:
        assert error.location.source == str(path) and error.location.line > 0
        return
    assert all(np.all(np.isfinite(value)) for name, value in numbers(ours).items() if "limits" not in name)


def is_supported(path):
    """Files with elements that the plant has no class for yet say so; that is checked elsewhere."""
    logging.getLogger("drake").setLevel(logging.ERROR)
    try:
        load(MultibodyPlant(1e-3), Parser, path)
    except NotImplementedError:
        return False
    except ParseError:
        return True
    finally:
        logging.getLogger("drake").setLevel(logging.NOTSET)
    return True


@pytest.mark.parametrize("path", files(), ids=lambda path: path.name)
def test_names_limits_and_dynamics_equal_drakes(path):
    if not is_supported(path):
        with pytest.raises(NotImplementedError, match=str(path)):
            load(MultibodyPlant(1e-3), Parser, path)
        return
    try:
        theirs = load(TheirPlant(1e-3), TheirParser, path)
    except RuntimeError:
        check_what_drake_refuses(path)
        return
    ours = load(MultibodyPlant(1e-3), Parser, path)
    assert names(ours) == names(theirs)
    name, error = worst(numbers(theirs), numbers(ours))
    assert error < TOLERANCE, name


def test_a_fault_of_one_part_in_a_hundred_million_is_seen(tmp_path):
    text = (MODELS / "old.sdf").read_text()
    inertial = '<link name="a"><inertial><mass>{}</mass></inertial>'
    paths = []
    for name, mass in (("right", 2.0), ("wrong", 2.0 * (1.0 + 1e-8))):
        path = tmp_path / f"{name}.sdf"
        path.write_text(text.replace('<link name="a">', inertial.format(repr(mass))))
        paths.append(path)
    theirs = load(TheirPlant(1e-3), TheirParser, paths[0])
    ours = load(MultibodyPlant(1e-3), Parser, paths[1])
    assert worst(numbers(theirs), numbers(ours))[1] > 1e-9


def test_every_public_name_of_pydrakes_module_is_here():
    import pydrake.multibody.parsing as theirs

    import sheldrake.multibody.parsing as ours

    missing = [name for name in dir(theirs) if not name.startswith("_") and name not in ours.__all__]
    assert missing == []
    for name in ours.__all__:
        for member in dir(getattr(theirs, name, object)):
            known = [field.name for field in getattr(getattr(ours, name), "__fields__", ())]
            assert member.startswith("_") or member in known or hasattr(getattr(ours, name), member), (name, member)
