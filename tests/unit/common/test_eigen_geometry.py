import copy
import math
import pickle

import numpy as np
import pytest

from sheldrake.autodiffutils import AutoDiffXd
from sheldrake.common.eigen_geometry import AngleAxis, AngleAxis_, Isometry3, Isometry3_, Quaternion, Quaternion_

HALF = math.sqrt(0.5)


def test_quaternion_constructors_agree():
    quarter = [HALF, HALF, 0.0, 0.0]
    R = [[1.0, 0.0, 0.0], [0.0, 0.0, -1.0], [0.0, 1.0, 0.0]]
    for q in (
        Quaternion(quarter),
        Quaternion(wxyz=np.array(quarter)[:, None]),
        Quaternion(*quarter),
        Quaternion(w=HALF, x=HALF, y=0, z=0),
        Quaternion(rotation=R),
        Quaternion(other=Quaternion(quarter)),
        AngleAxis(math.pi / 2, [1, 0, 0]).quaternion(),
        Isometry3(R, [1, 2, 3]).quaternion(),
    ):
        np.testing.assert_allclose(q.wxyz(), quarter, atol=1e-15)
        np.testing.assert_allclose(q.rotation(), R, atol=1e-15)
        np.testing.assert_allclose(q @ [0.0, 0.0, 1.0], [0.0, -1.0, 0.0], atol=1e-15)
    assert Quaternion().wxyz().tolist() == Quaternion.Identity().wxyz().tolist() == [1.0, 0.0, 0.0, 0.0]


def test_quaternion_parts_are_copies():
    q = Quaternion(0.5, 0.5, -0.5, 0.5)
    assert (q.w(), q.x(), q.y(), q.z()) == (0.5, 0.5, -0.5, 0.5)
    q.wxyz()[:] = 0.0
    q.xyz()[:] = 0.0
    assert q.xyz().tolist() == [0.5, -0.5, 0.5]
    q.set_wxyz(1, 0, 0, 0)
    assert q.w() == 1.0
    q.set_wxyz(wxyz=[0, 1, 0, 0])
    assert q.x() == 1.0


@pytest.mark.parametrize(
    "make, message",
    [
        (lambda: Quaternion([1, 2, 3, 4]), "Quaternion is not normalized"),
        (lambda: Quaternion().set_wxyz(1, 1, 0, 0), "not normalized"),
        (lambda: AngleAxis(0.5, [1, 1, 0]), "Axis is not normalized"),
        (lambda: AngleAxis().set_axis([0, 0, 2]), "Axis is not normalized"),
        (lambda: Isometry3(2 * np.eye(3), [0, 0, 0]), "not orthonormal"),
        (lambda: Isometry3(np.diag([1.0, 1, -1]), [0, 0, 0]), "right-hand rule"),
        (lambda: Isometry3(np.diag([1.0, 1, 1, 2])), "improperly scaled"),
    ],
)
def test_invalid_numbers(make, message):
    with pytest.raises(RuntimeError, match=message):
        make()


@pytest.mark.parametrize(
    "make",
    [
        lambda: Quaternion("a"),
        lambda: Quaternion([1, 0, 0]),
        lambda: Quaternion([[1, 0, 0, 0]]),
        lambda: Quaternion(1, 0, 0),
        lambda: Quaternion(q=[1, 0, 0, 0]),
        lambda: Quaternion() @ np.ones(4),
        lambda: Quaternion() @ np.ones((2, 3)),
        lambda: Quaternion().multiply(),
        lambda: Quaternion().multiply(position=[1, 2, 3]),
        lambda: AngleAxis() @ Quaternion(),
        lambda: AngleAxis(1.0),
        lambda: Isometry3() @ 3,
        lambda: Quaternion([AutoDiffXd(1.0), 0, 0, 0]),
        lambda: Quaternion_[AutoDiffXd](Quaternion()),
    ],
)
def test_wrong_types_say_what_is_accepted(make):
    with pytest.raises(TypeError, match=r"incompatible (constructor|function) arguments.*accepted"):
        make()


def test_products_keep_the_shape_of_vectors():
    q = Quaternion(0.5, 0.5, 0.5, 0.5)
    assert (q @ np.ones((3, 1))).shape == (3, 1)
    assert (q @ np.ones((3, 0))).shape == (3, 0)
    assert (q @ np.arange(6.0).reshape(3, 2)).tolist() == [[4.0, 5.0], [0.0, 1.0], [2.0, 3.0]]
    X = Isometry3(q, [1, 2, 3])
    assert (X @ np.zeros((3, 2))).tolist() == [[1.0, 1.0], [2.0, 2.0], [3.0, 3.0]]
    assert X.multiply(position=[0, 0, 0]).tolist() == [1.0, 2.0, 3.0]


def test_slerp_goes_the_short_way():
    a, b = Quaternion(), Quaternion(-HALF, 0, 0, -HALF)
    half = a.slerp(t=0.5, other=b)
    np.testing.assert_allclose(half.wxyz(), [math.cos(math.pi / 8), 0, 0, math.sin(math.pi / 8)], atol=1e-15)
    np.testing.assert_allclose(a.slerp(0.3, a).wxyz(), a.wxyz())


def test_angle_axis_is_at_most_half_a_turn():
    turned = AngleAxis(Quaternion(-0.6, 0.8, 0, 0))
    assert turned.angle() == pytest.approx(2 * math.atan2(0.8, 0.6))
    assert turned.axis().tolist() == [-1.0, 0.0, 0.0]
    none = AngleAxis(Quaternion(-1, 0, 0, 0))
    assert none.angle() == 0.0 and none.axis().tolist() == [1.0, 0.0, 0.0]
    assert AngleAxis(5.0, [1, 0, 0]).angle() == 5.0


@pytest.mark.parametrize(
    "value, numbers",
    [
        (Quaternion(0.5, 0.5, 0.5, 0.5), Quaternion.wxyz),
        (AngleAxis(0.5, [0, 1, 0]), AngleAxis.rotation),
        (Isometry3(np.eye(3), [1, 2, 3]), Isometry3.matrix),
    ],
)
def test_copies_and_pickles_are_independent(value, numbers):
    for twin in (copy.copy(value), copy.deepcopy(value), pickle.loads(pickle.dumps(value)), value.cast[float]()):
        assert type(twin) is type(value) and twin is not value
        assert numbers(twin).tolist() == numbers(value).tolist()


def test_other_scalars():
    cls = Quaternion_[AutoDiffXd]
    assert Quaternion_[float] is Quaternion and cls is not Quaternion
    assert cls.__name__ == "Quaternion_𝓣AutoDiffXd𝓤"
    q = Quaternion(0.5, 0.5, 0.5, 0.5).cast[AutoDiffXd]()
    assert type(q) is cls and not isinstance(q, Quaternion)
    assert [x.value() for x in q @ [1.0, 2.0, 3.0]] == [3.0, 1.0, 2.0]
    angle = AngleAxis_(AutoDiffXd(0.3, [1.0]), [0, 0, 1])
    assert type(angle) is AngleAxis_[AutoDiffXd]
    np.testing.assert_allclose(angle.rotation()[1, 0].derivatives(), [math.cos(0.3)])
    assert type(pickle.loads(pickle.dumps(q))) is cls
    X = Isometry3_[AutoDiffXd](np.eye(4))
    assert type(X @ X) is Isometry3_[AutoDiffXd]
    with pytest.raises(TypeError):
        X @ Isometry3()
    with pytest.raises(RuntimeError, match="Invalid instantiation"):
        q.cast[float]
    with pytest.raises(RuntimeError, match="Invalid instantiation"):
        Quaternion().cast[int]


def test_names():
    assert str(Quaternion()) == "Quaternion(w=1.0, x=0.0, y=0.0, z=0.0)"
    assert str(AngleAxis(0.5, [1, 0, 0])) == "AngleAxis(angle=0.5, axis=[1. 0. 0.])"
    assert str(Isometry3()) == str(np.eye(4))
    assert Quaternion.__module__ == "sheldrake.common.eigen_geometry"
