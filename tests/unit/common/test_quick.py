"""Short ways of values' methods: what they give, and what they leave to the long way."""

import gc
import sys

import numpy as np
import pytest

from sheldrake.common import _angle_axis, _quaternion, quick
from sheldrake.common._kernels import poses
from sheldrake.common.eigen_geometry import AngleAxis, Quaternion
from sheldrake.common.kernel import jit_enabled
from sheldrake.math import RigidTransform, RollPitchYaw, RotationMatrix, _rigid_transform, _roll_pitch_yaw
from sheldrake.math import _rotation_matrix as _rotation
from sheldrake.multibody.math import (
    RotationalInertia,
    SpatialForce,
    SpatialInertia,
    SpatialMomentum,
    SpatialVelocity,
    UnitInertia,
    _rotational_inertia,
    _spatial_inertia,
    _spatial_vectors,
    _unit_inertia,
)
from sheldrake.trajectories import BezierCurve, PiecewisePolynomial, _bezier, _interpolation

HOMES = [
    vars(module)
    for module in (
        _angle_axis,
        _quaternion,
        _rigid_transform,
        _roll_pitch_yaw,
        _rotation,
        _rotational_inertia,
        _spatial_inertia,
        _spatial_vectors,
        _unit_inertia,
        _interpolation,
        _bezier,
    )
] + [_spatial_vectors._SHORT]
pytestmark = pytest.mark.skipif(not jit_enabled(), reason="short ways are native")


def is_short_way(function) -> bool:
    return getattr(function, "__qualname__", "").startswith("short_way.")


@pytest.fixture(autouse=True, scope="module")
def all_ready():
    """Asks every short way so often that it is there."""
    for home in HOMES:
        for name in [name for name, value in home.items() if is_short_way(value)]:
            for _ in range(quick.FEW + 1):
                home[name]()
    assert not any(is_short_way(value) for home in HOMES for value in home.values())


def things(rng: np.random.Generator) -> dict:
    angle, p, q, v, w = rng.uniform(-3, 3), *rng.normal(size=(4, 3))
    axis, wxyz = rng.normal(size=3), rng.normal(size=4)
    axis, wxyz = axis / np.linalg.norm(axis), wxyz / np.linalg.norm(wxyz)
    R = RotationMatrix(RollPitchYaw(rng.uniform(-1.5, 1.5, 3)))
    X, Y = RigidTransform(R, p), RigidTransform(RotationMatrix(Quaternion(wxyz)), q)
    G = UnitInertia.SolidBox(0.1, 0.2, 0.3).ReExpress(R).ShiftFromCenterOfMass(p)
    M = SpatialInertia(2.0, -p, G)
    return {
        "angle": angle, "p": p, "axis": axis, "wxyz": wxyz, "R": R, "S": Y.rotation(), "X": X, "Y": Y, "G": G, "M": M,
        "V": SpatialVelocity(v, w), "W": SpatialVelocity(p, q), "F": SpatialForce(p, w), "L": SpatialMomentum(q, v),
        "quaternion": Quaternion(wxyz), "rpy": RollPitchYaw(p),
    }  # fmt: skip


CALLS = {
    "compose poses": lambda t: t["X"] @ t["Y"],
    "multiply poses": lambda t: t["X"].multiply(t["Y"]),
    "invert a pose": lambda t: t["X"].inverse(),
    "invert and compose": lambda t: t["X"].InvertAndCompose(t["Y"]),
    "a pose's matrix": lambda t: t["X"].GetAsMatrix4(),
    "a pose's rows": lambda t: t["X"].GetAsMatrix34(),
    "a pose of a matrix": lambda t: RigidTransform(t["X"].GetAsMatrix4()),
    "a pose of rpy": lambda t: RigidTransform(t["rpy"], t["p"]),
    "near": lambda t: t["X"].IsNearlyEqualTo(t["Y"], 0.5),
    "near itself": lambda t: t["X"].IsNearlyEqualTo(t["X"], 0.0),
    "not near itself": lambda t: t["X"].IsNearlyEqualTo(t["X"], -1.0),
    "equal": lambda t: [t["X"].IsExactlyEqualTo(other) for other in (t["X"], t["Y"], RigidTransform(t["R"], t["p"]))],
    "nothing": lambda t: [X.IsExactlyIdentity() for X in (t["X"], RigidTransform(), RigidTransform(t["p"]))],
    "nearly nothing": lambda t: [X.IsNearlyIdentity(1e-3) for X in (t["X"], RigidTransform(1e-4 * t["axis"]))],
    "difference": lambda t: t["X"].GetMaximumAbsoluteDifference(t["Y"]),
    "difference that is none": lambda t: t["X"].GetMaximumAbsoluteDifference(RigidTransform([np.nan, 1.0, 1.0])),
    "equal without end": lambda t: [FAR.IsExactlyEqualTo(FAR), FAR.IsNearlyEqualTo(FAR, 1.0)],
    "rotations equal": lambda t: [t["R"].IsExactlyEqualTo(t["R"]), t["R"].IsExactlyEqualTo(t["S"])],
    "rotations near": lambda t: [t["R"].IsNearlyEqualTo(t["S"], tolerance) for tolerance in (0.5, 1.0, 2.0)],
    "no rotation": lambda t: [t["R"].IsExactlyIdentity(), RotationMatrix().IsExactlyIdentity()],
    "nearly no rotation": lambda t: [t["R"].IsNearlyIdentity(), RotationMatrix.MakeXRotation(1e-14).IsNearlyIdentity()],
    "valid": lambda t: [R.IsValid() for R in (t["R"], t["S"], RotationMatrix.MakeUnchecked(t["R"].matrix() * 1.1))],
    "rotation between": lambda t: t["R"].InvertAndCompose(t["S"]),
    "compose rotations": lambda t: t["R"] @ t["S"],
    "invert a rotation": lambda t: t["R"].inverse(),
    "about x": lambda t: RotationMatrix.MakeXRotation(t["angle"]),
    "about y": lambda t: RotationMatrix.MakeYRotation(t["angle"]),
    "about z": lambda t: RotationMatrix.MakeZRotation(t["angle"]),
    "to quaternion": lambda t: t["R"].ToQuaternion(),
    "to angle and axis": lambda t: t["R"].ToAngleAxis(),
    "of nothing turned": lambda t: RotationMatrix().ToAngleAxis(),
    "to rpy": lambda t: t["R"].ToRollPitchYaw(),
    "of a matrix": lambda t: RotationMatrix(t["R"].matrix()),
    "of a quaternion": lambda t: RotationMatrix(t["quaternion"]),
    "of angle and axis": lambda t: RotationMatrix(AngleAxis(t["angle"], t["axis"])),
    "of rpy": lambda t: RotationMatrix(t["rpy"]),
    "rpy of numbers": lambda t: RollPitchYaw(*t["p"].tolist()),
    "rpy of a quaternion": lambda t: RollPitchYaw(t["quaternion"]),
    "rpy of a rotation": lambda t: RollPitchYaw(t["R"]),
    "rpy to quaternion": lambda t: t["rpy"].ToQuaternion(),
    "rpy to rotation": lambda t: t["rpy"].ToRotationMatrix(),
    "quaternion of numbers": lambda t: Quaternion(*t["wxyz"].tolist()),
    "quaternion of a list": lambda t: Quaternion(t["wxyz"].tolist()),
    "quaternion of an array": lambda t: Quaternion(t["wxyz"]),
    "quaternion to matrix": lambda t: t["quaternion"].rotation(),
    "product of quaternions": lambda t: t["quaternion"] @ t["S"].ToQuaternion(),
    "turned by a quaternion": lambda t: t["quaternion"].multiply(t["p"]),
    "invert a quaternion": lambda t: t["quaternion"].inverse(),
    "a sum": lambda t: t["V"] + t["W"],
    "a difference": lambda t: t["F"] - t["F"].Shift(t["p"]),
    "turned": lambda t: t["L"].Rotate(t["R"]),
    "velocity elsewhere": lambda t: t["V"].Shift(t["p"]),
    "force elsewhere": lambda t: t["F"].Shift(t["p"]),
    "momentum elsewhere": lambda t: t["L"].Shift(t["p"]),
    "moving frame": lambda t: t["V"].ComposeWithMovingFrameVelocity(t["p"], t["W"]),
    "power": lambda t: t["F"].dot(t["V"]),
    "power again": lambda t: t["V"] @ t["F"],
    "energy": lambda t: t["V"].dot(t["L"]),
    "inertia": lambda t: SpatialInertia(3.0, -t["p"], t["G"]),
    "inertia of a central one": lambda t: SpatialInertia.MakeFromCentralInertia(
        2.0, t["p"], RotationalInertia(1.0, 2.0, 2.5, 0.1, 0.2, 0.3)
    ),
    "inertia of numbers": lambda t: RotationalInertia(1.0, 2.0, 3.0, 0.1, 0.2, 0.3),
    "inertia of moments": lambda t: UnitInertia(1.0, 2.0, 2.5),
    "inertia turned": lambda t: t["M"].ReExpress(t["R"]),
    "inertia elsewhere": lambda t: t["M"].Shift(t["p"]),
    "unit inertia turned": lambda t: t["G"].ReExpress(t["R"]),
    "rotational inertia turned": lambda t: t["M"].CalcRotationalInertia().ReExpress(t["R"]),
    "six by six": lambda t: t["M"].CopyToFullMatrix6(),
    "six by six of none": lambda t: SpatialInertia.NaN().CopyToFullMatrix6(),
    "no inertia": lambda t: SpatialInertia.Zero(),
    "of a body": lambda t: [t["M"].IsPhysicallyValid(), SpatialInertia.NaN().IsPhysicallyValid()],
    "of none": lambda t: [M.IsNaN() for M in (t["M"], SpatialInertia.NaN(), SpatialInertia.Zero())],
    "without mass": lambda t: [M.IsZero() for M in (t["M"], SpatialInertia.NaN(), SpatialInertia.Zero())],
    "lines": lambda t: curve(PiecewisePolynomial.FirstOrderHold, t),
    "cubics": lambda t: curve(PiecewisePolynomial.CubicShapePreserving, t),
    "cubics at rest": lambda t: curve(PiecewisePolynomial.CubicShapePreserving, t, True),
    "a Bézier curve": lambda t: BezierCurve(1.0, 3.0, np.array([t["p"], t["axis"], t["wxyz"][1:]])).value(1.7),
    "one point": lambda t: BezierCurve(1.0, 3.0, t["p"].reshape(3, 1)).value(0.0),
    "two samples": lambda t: PiecewisePolynomial.CubicShapePreserving(
        [0.0, 0.3], np.array([t["p"], t["axis"]]).T, True
    ).polynomials.ravel(),
    "cubics with slopes": lambda t: curve(PiecewisePolynomial.CubicHermite, t, np.array([t["p"]] * 5).T),
    "box": lambda t: SpatialInertia.SolidBoxWithMass(1.5, 0.1, 0.2, 0.3),
    "unit box": lambda t: UnitInertia.SolidBox(0.1, 0.2, 0.3),
    "sphere": lambda t: SpatialInertia.SolidSphereWithMass(1.5, 0.2),
}


def curve(make, t, *more) -> np.ndarray:
    """Coefficients of a curve through five samples of which some are equal, with a time of their own each."""
    samples = np.array([t["p"], t["axis"], t["axis"], t["wxyz"][1:], t["p"]]).T
    return make([0.0, 0.3, 0.7, 1.5, 1.6], samples, *more).polynomials.ravel()


FAR = RigidTransform([np.inf, 0.0, 0.0])


def numbers(value) -> np.ndarray:
    if isinstance(value, list):
        return np.array(value, float)
    if isinstance(value, (float, bool, np.ndarray)):
        return np.asarray(value, float)
    return np.concatenate([numbers(getattr(value, name)).ravel() for name in value._FIELDS])


def leave_out(monkeypatch: pytest.MonkeyPatch) -> None:
    """Sends all methods the long way."""
    for home in HOMES:
        for name, value in home.items():
            if type(value) is type(len) and value.__name__ == "method":
                monkeypatch.setitem(home, name, quick._never)


@pytest.mark.parametrize("call", CALLS.values(), ids=CALLS)
def test_the_short_way_gives_what_the_long_way_gives(call, monkeypatch):
    """To a rounding of the products that BLAS sums in the order of the processor."""
    rng = np.random.default_rng(1)
    given = [things(rng) for _ in range(20)]
    short = [call(t) for t in given]
    leave_out(monkeypatch)
    for t, found in zip(given, short):
        with np.errstate(invalid="ignore"):
            expected = call(t)
        assert type(found) is type(expected)
        np.testing.assert_allclose(numbers(found), numbers(expected), rtol=1e-14, atol=2e-15)
        if isinstance(expected, np.ndarray):
            assert found.flags.writeable == expected.flags.writeable
            assert found.shape == expected.shape


def test_results_are_new_and_what_is_in_slots_is_read_only():
    X = RigidTransform(RollPitchYaw(0.1, 0.2, 0.3), [1.0, 2.0, 3.0])
    Y, Z = X.inverse(), X.inverse()
    assert Y is not Z
    assert Y.rotation() is not Z.rotation()
    assert not np.shares_memory(Y.translation(), Z.translation())
    assert not Y.translation().flags.writeable
    Y.set_translation([0.0, 0.0, 0.0])
    assert Z.translation().any()
    with pytest.raises(ValueError, match="read-only"):
        Z.translation()[0] = 1.0
    assert gc.is_tracked(Y)


def test_nothing_is_kept_of_results():
    X = RigidTransform(RollPitchYaw(0.1, 0.2, 0.3), [1.0, 2.0, 3.0])

    def use() -> None:
        for _ in range(1000):
            X.inverse() @ X
            X.IsNearlyEqualTo(X, 0.0)
            X.rotation().ToAngleAxis()

    use()
    gc.collect()
    counts = [sys.getrefcount(thing) for thing in (RigidTransform, RotationMatrix, AngleAxis)]
    blocks = sys.getallocatedblocks()
    use()
    gc.collect()
    assert [sys.getrefcount(thing) for thing in (RigidTransform, RotationMatrix, AngleAxis)] == counts
    assert sys.getallocatedblocks() < blocks + 100


def test_what_is_not_exactly_of_its_type_goes_the_long_way():
    class Mine(RigidTransform):
        pass

    X = RigidTransform([1.0, 2.0, 3.0])
    assert _rigid_transform._compose(X, X) is not None
    assert _rigid_transform._compose(Mine(), X) is None
    assert _rigid_transform._compose(X) is None
    assert _rigid_transform._compose() is None
    assert _rigid_transform._compose(X, X, X) is None
    assert _rigid_transform._compose(None, 1.0) is None
    assert _rigid_transform._compose(object.__new__(RigidTransform), X) is None  # nothing in its slots
    assert _rigid_transform._are_near(X, X, 1) is None  # an int
    assert type(Mine() @ X) is RigidTransform
    assert _rotation._checked_matrix(np.eye(3, dtype=np.float32)) is None
    assert _rotation._checked_matrix(np.eye(4)[:3, :3]) is None  # not one piece of memory
    assert _rotation._checked_matrix(2.0 * np.eye(3)) is None  # no rotation: the long way says why
    turned = RotationMatrix.MakeZRotation(0.3).matrix().T
    np.testing.assert_array_equal(RotationMatrix(turned).matrix(), turned)
    with pytest.raises(RuntimeError, match="not a rotation matrix"):
        RotationMatrix(2.0 * np.eye(3))
    with pytest.raises(RuntimeError, match="not normalized"):
        Quaternion(1.0, 1.0, 0.0, 0.0)
    with pytest.raises(RuntimeError, match="IsPhysicallyValid"):
        SpatialInertia(1.0, [0.0, 0.0, 0.0], UnitInertia(1.0, 1.0, 3.0))
    with pytest.raises(RuntimeError, match="not positive"):
        SpatialInertia.SolidBoxWithMass(1.0, -0.1, 0.2, 0.3)


def test_a_form_that_a_block_has_no_room_for_is_refused():
    """Each would be read or written beyond the block."""

    class Four:
        __slots__ = ("a", "b", "c", "d")

    class Holder:
        __slots__ = ("of",)

    cube = quick._Writer(poses.invert_pose, True, ())
    cube._take(0, (), (2, 2, 2))
    wide = quick._Writer(poses.invert_pose, True, ())
    wide._make(quick.Slots(Four, dict.fromkeys("abcd", float)), True)
    deep = quick._Writer(poses.invert_pose, True, ())
    deep._take(0, ((Holder, "of"), (Holder, "of"), (Holder, "of")), float)
    many = quick._Writer(poses.invert_pose, True, ())
    for _ in range(9):
        many._make(float, True)
    for writer in (cube, wide, deep, many):
        with pytest.raises(TypeError, match="a short way takes"):
            writer._check([[row[0], 0, *row[1:]] for row in writer.taken])
