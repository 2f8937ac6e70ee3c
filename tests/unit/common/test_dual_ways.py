"""Short ways of poses of AutoDiffXd: values, derivatives and how many there are, as in plain arithmetic of duals."""

import gc
import sys

import numpy as np
import pytest
from tests.unit.common.test_quick import HOMES, is_short_way

from sheldrake.autodiffutils import AutoDiffXd, InitializeAutoDiff
from sheldrake.common import _dual_ways, quick
from sheldrake.common._kernels import poses
from sheldrake.common.kernel import jit_enabled
from sheldrake.math import RigidTransform, RigidTransform_, RollPitchYaw, RollPitchYaw_, RotationMatrix_
from sheldrake.math._rigid_transform import POSE
from sheldrake.multibody.math import SpatialForce_, SpatialMomentum_, SpatialVelocity_

Pose, Rotation, Angles = RigidTransform_[AutoDiffXd], RotationMatrix_[AutoDiffXd], RollPitchYaw_[AutoDiffXd]
Velocity, Force = SpatialVelocity_[AutoDiffXd], SpatialForce_[AutoDiffXd]
pytestmark = pytest.mark.skipif(not jit_enabled(), reason="short ways are native")


def duals(rng: np.random.Generator, shape: tuple[int, ...], n: int) -> np.ndarray:
    size = int(np.prod(shape))
    return InitializeAutoDiff(rng.normal(size=size), rng.normal(size=(size, n))).reshape(shape)


def things(rng: np.random.Generator, n: int) -> dict:
    rpy, p, q = (duals(rng, (3,), n) for _ in range(3))
    rpy = rpy * 0.5
    (s, c), (u, w) = (
        [(f(np.array([x]))[0]) for f in (np.sin, np.cos)] for x in rpy[:2]
    )  # a rotation about x, then about y, in plain arithmetic
    zero, one = AutoDiffXd(0.0), AutoDiffXd(1.0)
    about_x = np.array([[one, zero, zero], [zero, c, -s], [zero, s, c]])
    about_y = np.array([[w, zero, u], [zero, one, zero], [-u, zero, w]])
    R = Rotation.MakeUnchecked(about_x.dot(about_y))
    S = RigidTransform(RollPitchYaw(rng.normal(size=3)), rng.normal(size=3)).cast[AutoDiffXd]()
    return {
        "R": R, "X": Pose(R, p), "Y": Pose(Rotation.MakeUnchecked(about_x), q), "constant": S, "p": p,
        "rpy": Angles(rpy), "V": Velocity(p, q), "W": Velocity(q, rpy), "F": Force(rpy, p),
        "L": SpatialMomentum_[AutoDiffXd](q, p), "floats": rng.normal(size=3),
        "half": np.array([p[0], AutoDiffXd(2.0), p[2]]),
    }  # fmt: skip


CALLS = {
    "compose poses": lambda t: t["X"] @ t["Y"],
    "compose with a constant": lambda t: t["X"] @ t["constant"],
    "compose a constant": lambda t: t["constant"] @ t["X"],
    "compose constants": lambda t: t["constant"] @ t["constant"],
    "a constant rotation": lambda t: Pose(t["p"]) @ t["Y"],
    "invert a pose": lambda t: t["X"].inverse(),
    "invert a position": lambda t: Pose(t["half"]).inverse(),
    "invert and compose": lambda t: t["X"].InvertAndCompose(t["Y"]),
    "a pose's matrix": lambda t: t["X"].GetAsMatrix4(),
    "a pose's rows": lambda t: t["Y"].GetAsMatrix34(),
    "move a point": lambda t: t["X"] @ t["p"],
    "move a point of floats": lambda t: t["X"] @ t["floats"],
    "move by a constant": lambda t: t["constant"] @ t["half"],
    "near": lambda t: [t["X"].IsNearlyEqualTo(t["Y"], tolerance) for tolerance in (0.1, 10.0)],
    "equal": lambda t: [t["X"].IsExactlyEqualTo(other) for other in (t["X"], t["Y"])],
    "compose rotations": lambda t: t["R"] @ t["Y"].rotation(),
    "rotation between": lambda t: t["R"].InvertAndCompose(t["Y"].rotation()),
    "turn a vector": lambda t: t["R"] @ t["p"],
    "valid": lambda t: t["R"].IsValid(),
    "to quaternion": lambda t: t["X"].rotation().ToQuaternion(),
    "to quaternion, about one axis": lambda t: t["Y"].rotation().ToQuaternion(),
    "to rpy": lambda t: t["R"].ToRollPitchYaw(),
    "rpy of a rotation": lambda t: Angles(t["R"]),
    "rpy to rotation": lambda t: t["rpy"].ToRotationMatrix(),
    "rotation of rpy": lambda t: Rotation(t["rpy"]),
    "rpy to quaternion": lambda t: t["rpy"].ToQuaternion(),
    "quaternion to rotation": lambda t: t["R"].ToQuaternion().rotation(),
    "product of quaternions": lambda t: t["R"].ToQuaternion() @ t["rpy"].ToQuaternion(),
    "invert a quaternion": lambda t: t["R"].ToQuaternion().inverse(),
    "rotation of a quaternion": lambda t: Rotation(t["R"].ToQuaternion()),
    "a sum": lambda t: t["V"] + t["W"],
    "a difference": lambda t: t["V"] - t["W"],
    "turned": lambda t: t["F"].Rotate(t["R"]),
    "velocity elsewhere": lambda t: t["V"].Shift(t["p"]),
    "force elsewhere": lambda t: t["F"].Shift(t["half"]),
    "moving frame": lambda t: t["V"].ComposeWithMovingFrameVelocity(t["p"], t["W"]),
    "power": lambda t: t["F"].dot(t["V"]),
    "energy": lambda t: t["V"].dot(t["L"]),
}


def is_native(value: object) -> bool:
    return type(value) is type(len) and value.__name__ == "method"


@pytest.fixture(autouse=True, scope="module")
def all_ready():
    """Asks every short way so often that it is there, for duals too."""
    patience = pytest.MonkeyPatch()
    patience.setattr(_dual_ways, "FEW", 0)
    patience.setattr(_dual_ways, "_TIMES", 0)
    for home in HOMES:
        for name in [name for name, value in home.items() if is_short_way(value)]:
            for _ in range(quick.FEW + 1):
                home[name]()
    given = things(np.random.default_rng(0), 3)
    for call in CALLS.values():
        call(given)
    yield
    patience.undo()


def numbers(value) -> list:
    if isinstance(value, list):
        return value
    if isinstance(value, (bool, AutoDiffXd)):
        return [value]
    if isinstance(value, np.ndarray):
        return value.ravel().tolist()
    return [x for name in value._FIELDS for x in numbers(getattr(value, name))]


@pytest.mark.parametrize("n", [1, 3, 64, 65])
@pytest.mark.parametrize("call", CALLS.values(), ids=CALLS)
def test_duals_are_those_of_plain_arithmetic(call, n, monkeypatch):
    rng = np.random.default_rng(n)
    given = [things(rng, n) for _ in range(5)]
    short = [call(t) for t in given]
    for home in HOMES:
        for name, value in home.items():
            if is_native(value):
                monkeypatch.setitem(home, name, quick._never)
    for t, found in zip(given, short):
        expected = call(t)
        assert type(found) is type(expected)
        if isinstance(expected, np.ndarray):
            assert found.flags.writeable == expected.flags.writeable
            assert found.shape == expected.shape
        assert len(numbers(found)) == len(numbers(expected))
        for x, y in zip(numbers(found), numbers(expected)):
            assert type(x) is type(y)
            if isinstance(y, AutoDiffXd):
                assert x.value() == pytest.approx(y.value(), rel=1e-13, abs=1e-14)
                assert x.derivatives().shape == y.derivatives().shape
                np.testing.assert_allclose(x.derivatives(), y.derivatives(), rtol=1e-11, atol=1e-12)
            else:
                assert x == y


def test_the_short_way_of_duals_is_taken(monkeypatch):
    """A test of the tests: without the plain way these calls still answer."""
    t = things(np.random.default_rng(0), 3)
    monkeypatch.setattr(Pose, "_turned", None)
    assert isinstance(t["X"] @ t["Y"], Pose)
    assert isinstance(t["X"] @ t["constant"], Pose)


def test_calls_with_other_arguments_make_no_way():
    """What does not fit is not followed, however often it comes."""
    ask = _dual_ways.not_yet(None, poses.compose_poses, (POSE, POSE), POSE, True)
    t = things(np.random.default_rng(0), 2)
    for other in (t["p"], t["floats"], t["R"], RigidTransform(), 1.0, None):
        assert ask(t["X"], other) is None
    assert ask() is ask(t["X"]) is None


def test_values_have_the_bits_of_floats():
    t = things(np.random.default_rng(1), 4)

    def plain(X) -> RigidTransform:
        return RigidTransform(np.array([[x.value() for x in row] for row in X.GetAsMatrix34()]))

    dual = (t["X"] @ t["Y"]).GetAsMatrix34()
    assert [x.value() for x in dual.ravel()] == (plain(t["X"]) @ plain(t["Y"])).GetAsMatrix34().ravel().tolist()


def test_numbers_of_derivatives_that_differ_are_refused():
    rng = np.random.default_rng(0)
    X, Y = (Pose(things(rng, n)["R"], duals(rng, (3,), n)) for n in (2, 3))
    with pytest.raises(RuntimeError, match="3 derivatives"):
        X @ Y


def test_results_share_nothing_with_what_was_given():
    t = things(np.random.default_rng(0), 2)
    X, Y = t["X"] @ t["Y"], t["X"] @ t["Y"]
    a, b = X.translation()[0], Y.translation()[0]
    assert a is not b
    assert not np.shares_memory(a._d, b._d)
    assert not X.translation().flags.writeable
    assert gc.is_tracked(X)


@pytest.fixture
def garbage_often():
    """Collects garbage at every chance, and calls a function meanwhile, as a finalizer might."""
    hooks, threshold = gc.callbacks.copy(), gc.get_threshold()

    def begin(call) -> None:
        gc.callbacks.append(lambda phase, info: call())
        gc.set_threshold(1)

    yield begin
    gc.set_threshold(*threshold)
    gc.callbacks[:] = hooks


def test_what_finalizers_call_while_duals_are_made_leaves_their_numbers_alone(garbage_often):
    rng = np.random.default_rng(0)
    t, other = things(rng, 3), things(rng, 5)

    def numbers_of(t: dict) -> list:
        return [(x.value(), *x.derivatives()) for x in (t["X"] @ t["Y"]).GetAsMatrix34().ravel().tolist()]

    expected, calls = numbers_of(t), []
    garbage_often(lambda: calls.append(other["X"] @ other["Y"]))
    for _ in range(50):
        assert numbers_of(t) == expected
    assert calls


def test_nothing_is_kept_of_results():
    t = things(np.random.default_rng(0), 3)

    def use() -> None:
        for _ in range(300):
            (t["X"] @ t["constant"]).inverse() @ t["p"]
            t["X"].IsNearlyEqualTo(t["Y"], 0.0)
            t["F"].dot(t["V"])

    use()
    gc.collect()
    kinds = (Pose, Rotation, AutoDiffXd)
    counts, blocks = [sys.getrefcount(thing) for thing in kinds], sys.getallocatedblocks()
    nothing = sys.getrefcount(None)
    use()
    gc.collect()
    assert [sys.getrefcount(thing) for thing in kinds] == counts
    assert sys.getallocatedblocks() < blocks + 100
    assert abs(sys.getrefcount(None) - nothing) < 50
