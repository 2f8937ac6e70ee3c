import copy
import math
import pickle

import numpy as np
import pytest

from sheldrake.autodiffutils import AutoDiffXd
from sheldrake.common.value import Value
from sheldrake.math import RotationMatrix
from sheldrake.multibody.math import (
    RotationalInertia,
    RotationalInertia_,
    SpatialAcceleration,
    SpatialForce,
    SpatialInertia,
    SpatialInertia_,
    SpatialMomentum,
    SpatialVelocity,
    SpatialVelocity_,
    UnitInertia,
    UnitInertia_,
)
from sheldrake.multibody.plant import CalcContactFrictionFromSurfaceProperties, CoulombFriction_
from sheldrake.symbolic import Expression, Formula, Variable

KINDS = [
    (SpatialVelocity, ("w", "v", "V")),
    (SpatialAcceleration, ("alpha", "a", "A")),
    (SpatialForce, ("tau", "f", "F")),
    (SpatialMomentum, ("h", "l", "L")),
]


@pytest.mark.parametrize("cls, names", KINDS)
def test_vector_space(cls, names):
    top, bottom, whole = names
    a = cls(**{top: [1, 2, 3], bottom: [4, 5, 6]})
    assert cls(**{whole: [1, 2, 3, 4, 5, 6]}).get_coeffs().tolist() == a.get_coeffs().tolist()
    assert a.rotational().tolist() == [1, 2, 3] and a.translational().tolist() == [4, 5, 6]
    assert (a + a - 3 * a).get_coeffs().tolist() == (-a).get_coeffs().tolist() == (a * -1).get_coeffs().tolist()
    assert np.isnan(cls().get_coeffs()).all()
    assert cls.Zero().get_coeffs().tolist() == [0.0] * 6
    b = copy.copy(a)
    kept = b
    b += a
    b *= 2
    b -= a
    assert b is kept and b.get_coeffs().tolist() == [3, 6, 9, 12, 15, 18]
    assert a.get_coeffs().tolist() == [1, 2, 3, 4, 5, 6]
    assert b.SetZero() is b and b.get_coeffs().tolist() == [0.0] * 6
    assert pickle.loads(pickle.dumps(a)).get_coeffs().tolist() == a.get_coeffs().tolist()
    assert repr(a) == f"{cls.__name__}(\n  {top}=[1.0, 2.0, 3.0],\n  {bottom}=[4.0, 5.0, 6.0],\n)"
    assert type(Value(a)) is Value[cls]
    with pytest.raises(ValueError):
        a.rotational()[0] = 1.0
    a.get_coeffs()[:] = 0.0
    assert a.rotational()[0] == 1.0
    with pytest.raises(TypeError, match="incompatible constructor"):
        cls([1, 2, 3])


def test_kinds_do_not_mix():
    V, A, F = SpatialVelocity.Zero(), SpatialAcceleration.Zero(), SpatialForce.Zero()
    for wrong in (
        lambda: V + A,
        lambda: V * V,
        lambda: V / 2,
        lambda: F.dot(F),
        lambda: A @ F,
        lambda: V.Rotate(np.eye(3)),
        lambda: RotationMatrix() @ V,
        lambda: V.Shift([1, 2]),
        lambda: A.Shift([1, 2, 3]),
        lambda: V.dot(),
        lambda: SpatialVelocity_[AutoDiffXd].Zero() + V,
    ):
        with pytest.raises(TypeError):
            wrong()


def test_known_shifts():
    z, x = [0, 0, 1], [1, 0, 0]
    assert SpatialVelocity(z, [0, 0, 0]).Shift(offset=x).translational().tolist() == [0, 1, 0]
    assert SpatialForce([0, 0, 0], [0, 1, 0]).Shift(x).rotational().tolist() == [0, 0, -1]
    assert SpatialMomentum([0, 0, 0], [0, 1, 0]).Shift(x).rotational().tolist() == [0, 0, -1]
    still = SpatialAcceleration([0, 0, 0], [0, 0, 0])
    turning = still.Shift(offset=x, angular_velocity_of_this_frame=[0, 0, 2])
    assert turning.translational().tolist() == [-4, 0, 0]
    moving = still.ComposeWithMovingFrameAcceleration(
        position_of_moving_frame=[0, 0, 0],
        angular_velocity_of_this_frame=[0, 0, 2],
        velocity_of_moving_frame=SpatialVelocity([0, 0, 0], x),
        acceleration_of_moving_frame=still,
    )
    assert moving.translational().tolist() == [0, 4, 0], "the Coriolis acceleration is 2 w x v"


def test_shape_constructors():
    z = [0, 0, 1]
    assert UnitInertia.SolidBox(1, 2, 3).get_moments() == pytest.approx([13 / 12, 10 / 12, 5 / 12])
    assert UnitInertia.SolidCapsule(0.5, 0, z).get_moments() == pytest.approx([0.1, 0.1, 0.1])
    assert UnitInertia.SolidCapsule(0, 2, z).get_moments() == pytest.approx([1 / 3, 1 / 3, 0])
    np.testing.assert_allclose(
        UnitInertia.SolidCylinderAboutEnd(1, 2, z).CopyToFullMatrix3(),
        UnitInertia.SolidCylinder(1, 2, z).ShiftFromCenterOfMass([0, 0, 1]).CopyToFullMatrix3(),
    )
    for wrong in (
        lambda: UnitInertia.SolidBox(-1, 2, 3),
        lambda: UnitInertia.SolidCylinder(-1, 2, z),
        lambda: UnitInertia.ThinRod(0, z),
        lambda: UnitInertia.StraightLine(0, z),
        lambda: UnitInertia.AxiallySymmetric(5, 2, z),
        lambda: UnitInertia.SolidCylinder(1, 2, [1, 1, 1]),
        lambda: UnitInertia().SetFromRotationalInertia(RotationalInertia(1, 1, 1), 0),
    ):
        with pytest.raises(RuntimeError, match=r"UnitInertia|unit_vector"):
            wrong()


@pytest.mark.parametrize(
    "mass, com, moments",
    [
        (-1.0, [0, 0, 0], (1, 1, 1)),
        (math.nan, [0, 0, 0], (1, 1, 1)),
        (math.inf, [0, 0, 0], (1, 1, 1)),
        (1.0, [0, math.nan, 0], (1, 1, 1)),
        (1.0, [0, 0, 0], (1, 1, 3)),
        (1.0, [0, 0, 0], (-1, 1, 1)),
        (1.0, [0, 0, 0], (math.nan, 1, 1)),
        (2.0, [1, 2, 3], (2, 3, 4)),
    ],
)
def test_impossible_bodies_are_refused(mass, com, moments):
    G = UnitInertia(*moments)
    with pytest.raises(RuntimeError, match=r"Spatial inertia fails SpatialInertia::IsPhysicallyValid\(\)"):
        SpatialInertia(mass=mass, p_PScm_E=com, G_SP_E=G)
    assert not SpatialInertia(mass, com, G, skip_validity_check=True).IsPhysicallyValid()


def test_massless_and_nan():
    assert SpatialInertia.Zero().IsPhysicallyValid() and SpatialInertia.Zero().IsZero()
    assert SpatialInertia.NaN().IsNaN() and not SpatialInertia.NaN().IsPhysicallyValid()
    M = SpatialInertia.SolidSphereWithMass(1, 1)
    M.SetNaN()
    assert M.IsNaN()
    M = SpatialInertia.Zero()
    M += SpatialInertia.Zero()
    assert M.IsZero()
    with pytest.raises(RuntimeError, match="must be positive"):
        SpatialInertia.MakeFromCentralInertia(0, [0, 0, 0], RotationalInertia(1, 1, 1))


def test_inertia_types():
    G = UnitInertia(2, 3, 4)
    for result in (G + G, G - G, G * 2, 2 * G, G / 2, G.ShiftToThenAwayFromCenterOfMass(1, [0, 0, 0], [1, 0, 0])):
        assert type(result) is RotationalInertia
    R = RotationMatrix.MakeXRotation(0.1)
    for result in (
        G.ReExpress(R_AE=R),
        G.ShiftFromCenterOfMass(p_BcmQ_E=[1, 2, 3]),
        G.ShiftToCenterOfMass(p_QBcm_E=[0, 0, 0]),
        copy.copy(G),
        pickle.loads(pickle.dumps(G)),
        UnitInertia(I=RotationalInertia(2, 3, 4)),
    ):
        assert type(result) is UnitInertia
    assert isinstance(G, RotationalInertia)
    assert (G * [1, 1, 1]).tolist() == [2, 3, 4]
    dual = UnitInertia_[AutoDiffXd](2, 3, 4)
    assert isinstance(dual, RotationalInertia_[AutoDiffXd]) and not isinstance(dual, RotationalInertia)
    assert [x.value() for x in (dual * [1, 1, 1])] == [2, 3, 4]
    assert type(SpatialInertia_[AutoDiffXd].SolidBoxWithMass(AutoDiffXd(2, [1.0]), 1, 2, 3)).__name__.endswith("𝓤")


def test_inertia_access():
    I = RotationalInertia(2, 3, 4, 0.1, 0.2, 0.3)
    assert I.get_moments().tolist() == [2, 3, 4] and I.get_products().tolist() == [0.1, 0.2, 0.3]
    assert I[0, 1] == I[1, 0] == 0.1 and I[2, 1] == 0.3
    with pytest.raises(IndexError):
        I[3, 0]
    with pytest.raises(TypeError):
        I[0]
    assert (I.rows(), I.cols(), I.Trace(), I.CalcMaximumPossibleMomentOfInertia()) == (3, 3, 9, 4.5)
    moments, axes = I.CalcPrincipalMomentsAndAxesOfInertia()
    assert axes.IsValid() and (np.diff(moments) > 0).all()
    np.testing.assert_allclose(axes.matrix() @ np.diag(moments) @ axes.matrix().T, I.CopyToFullMatrix3(), atol=1e-15)
    kept = I
    I += RotationalInertia(1, 1, 1)
    I *= 2
    I /= 2
    I -= RotationalInertia(1, 1, 1)
    assert I is kept and I.get_moments() == pytest.approx([2, 3, 4])
    I.SetZero()
    assert I.IsZero()
    I.SetToNaN()
    assert I.IsNaN() and RotationalInertia().IsNaN()
    with pytest.raises(RuntimeError, match="not finite"):
        I.CalcPrincipalMomentsOfInertia()


def test_inertia_parts_are_copies():
    M = SpatialInertia.MakeFromCentralInertia(mass=2, p_PScm_E=[1, 2, 3], I_SScm_E=RotationalInertia(2, 3, 4))
    M.get_com()[:] = 0
    M.get_unit_inertia().SetZero()
    assert M.get_com().tolist() == [1, 2, 3] and not M.get_unit_inertia().IsZero()
    twin = pickle.loads(pickle.dumps(M))
    assert twin.CopyToFullMatrix6().tolist() == M.CopyToFullMatrix6().tolist()
    with pytest.raises(TypeError, match="incompatible"):
        SpatialInertia("2", [0, 0, 0], UnitInertia(1, 1, 1))
    for wrong in (lambda: M * M, lambda: M * 3, lambda: M + M):
        with pytest.raises(TypeError):
            wrong()


def test_ellipsoid_of_an_ellipsoid():
    M = SpatialInertia.SolidEllipsoidWithMass(2.0, 0.3, 0.5, 0.1).Shift([1, 2, 3])
    half_axes, X = M.CalcPrincipalSemiDiametersAndPoseForSolidEllipsoid()
    np.testing.assert_allclose(half_axes, [0.5, 0.3, 0.1], atol=1e-14)
    np.testing.assert_allclose(X.translation(), [-1, -2, -3])


def test_derivative_of_an_inertia():
    M = SpatialInertia_[AutoDiffXd].SolidBoxWithMass(2.0, AutoDiffXd(1.0, [1.0]), 2.0, 3.0)
    np.testing.assert_allclose(M.CalcRotationalInertia()[1, 1].derivatives(), [2.0 * 2.0 / 12.0])


def test_tests_of_symbolic_inertias_give_formulas():
    I_, M_ = RotationalInertia_[Expression], SpatialInertia_[Expression]
    I = I_(2.0, 3.0, 4.0)
    M = M_(mass=1.0, p_PScm_E=np.zeros(3), G_SP_E=UnitInertia_[Expression](1.0, 1.0, 1.0))
    for answer, expected in (
        (I.CouldBePhysicallyValid(), True),
        (I_(1.0, 1.0, 10.0).CouldBePhysicallyValid(), False),
        (I.IsNaN(), False),
        (I.IsZero(), False),
        (I.IsNearlyEqualTo(I_(2.0, 3.0, 4.1), 0.1), True),
        (I.IsNearlyEqualTo(I_(2.0, 3.0, 4.5), 0.1), False),
        (M.IsPhysicallyValid(), True),
        (M.IsNaN(), False),
        (M.IsZero(), False),
    ):
        assert isinstance(answer, Formula) and answer.Evaluate() is expected
    x = Variable("x")
    free = I_(Expression(x), 3.0, 4.0)
    assert not free.IsNaN().Evaluate({x: 1.0})
    assert free.IsNearlyEqualTo(I, 0.1).Evaluate({x: 2.0}) and not free.IsNearlyEqualTo(I, 0.1).Evaluate({x: 9.0})
    with pytest.raises(RuntimeError, match="variable x"):
        free.CouldBePhysicallyValid()


def test_friction_of_duals_and_symbols():
    for T in (AutoDiffXd, Expression):
        friction = CoulombFriction_[T](static_friction=T(0.8), dynamic_friction=T(0.5))
        assert isinstance(friction.static_friction(), T) and isinstance(hash(friction), int)
        mean = CalcContactFrictionFromSurfaceProperties(friction, friction)
        assert isinstance(mean.dynamic_friction(), T)
        with pytest.raises(RuntimeError, match="less than or equal"):
            CoulombFriction_[T](T(0.5), T(0.8))
    with pytest.raises(RuntimeError, match="variable mu"):
        CoulombFriction_[Expression](Expression(Variable("mu")), Expression(0.1))


def test_parts_in_any_form_make_the_same_vector():
    top, bottom = [1, 2.5, -0.0], [4.0, 5, 6.0]
    expected = np.array([*top, *bottom], float)
    parts = {list: (top, bottom), tuple: (tuple(top), tuple(bottom)), np.array: (np.array(top), np.array(bottom))}
    forms = [SpatialForce(a, b) for a, _ in parts.values() for _, b in parts.values()]
    forms += [SpatialForce(tau=a, f=b) for a, _ in parts.values() for _, b in parts.values()]
    forms += [SpatialForce(f=bottom, tau=top), SpatialForce(top, f=np.array(bottom)), SpatialForce(expected.tolist())]
    forms += [SpatialForce(expected), SpatialForce(F=expected), SpatialForce(np.array(top)[:, None], bottom)]
    for F in forms:
        assert F.get_coeffs().tobytes() == expected.tobytes()
    expected[:] = 0.0  # which nobody sees
    assert forms[-2].rotational()[0] == 1.0


@pytest.mark.parametrize("given", [([1, 2], [3, 4, 5, 6]), ([1, 2, 3], [4, 5]), ([1, 2, 3, 4, 5],), (None, [1, 2, 3])])
def test_parts_of_other_sizes_or_contents_are_refused(given):
    with pytest.raises(TypeError, match="incompatible"):
        SpatialForce(*given)
