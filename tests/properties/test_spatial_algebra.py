"""Laws of spatial algebra: what does not depend on the point, the frame or the order of steps."""

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from sheldrake.math import RollPitchYaw, RotationMatrix
from sheldrake.multibody.math import (
    RotationalInertia,
    SpatialAcceleration,
    SpatialForce,
    SpatialInertia,
    SpatialMomentum,
    SpatialVelocity,
    UnitInertia,
)

numbers = st.floats(-3, 3)
vectors = st.tuples(numbers, numbers, numbers).map(np.array)
sixes = st.tuples(*[numbers] * 6).map(np.array)
rotations = vectors.map(lambda rpy: RotationMatrix(RollPitchYaw(rpy)))
masses = st.floats(0.1, 10)
sizes = st.floats(0.1, 2)


@st.composite
def bodies(draw):
    box = SpatialInertia.SolidBoxWithMass(draw(masses), draw(sizes), draw(sizes), draw(sizes))
    return box.ReExpress(draw(rotations)).Shift(draw(vectors))


def same(a, b, tolerance=1e-11):
    np.testing.assert_allclose(a, b, rtol=tolerance, atol=tolerance)


@given(sixes, sixes, vectors, rotations)
def test_power_does_not_depend_on_point_or_frame(f, v, p, R):
    F, V = SpatialForce(f), SpatialVelocity(v)
    same(F.Shift(p) @ V.Shift(p), F @ V)
    same(F.Rotate(R) @ V.Rotate(R), F @ V)


@given(sixes, vectors, vectors)
def test_shifts_add_up(c, p, q):
    for cls in (SpatialVelocity, SpatialForce, SpatialMomentum):
        same(cls(c).Shift(p).Shift(q).get_coeffs(), cls(c).Shift(p + q).get_coeffs())
    A, w = SpatialAcceleration(c), c[3:]
    same(A.Shift(p, w).Shift(q, w).get_coeffs(), A.Shift(p + q, w).get_coeffs())
    same(A.Shift(p, [0, 0, 0]).get_coeffs(), A.ShiftWithZeroAngularVelocity(p).get_coeffs())


@given(bodies(), sixes, vectors, rotations)
def test_kinetic_energy_does_not_depend_on_point_or_frame(M, v, p, R):
    V = SpatialVelocity(v)
    energy = (M * V) @ V
    assert energy >= -1e-12
    same((M.Shift(p) * V.Shift(p)) @ V.Shift(p), energy, 1e-10)
    same((M.ReExpress(R) * V.Rotate(R)) @ V.Rotate(R), energy, 1e-10)
    same((M * V).Shift(p).get_coeffs(), (M.Shift(p) * V.Shift(p)).get_coeffs(), 1e-10)


@given(bodies(), vectors, vectors, rotations)
def test_inertia_moves_there_and_back(M, p, q, R):
    same(M.Shift(p).Shift(q).CopyToFullMatrix6(), M.Shift(p + q).CopyToFullMatrix6(), 1e-10)
    same(M.ReExpress(R).ReExpress(R.inverse()).CopyToFullMatrix6(), M.CopyToFullMatrix6(), 1e-10)
    assert M.Shift(p).IsPhysicallyValid() and M.ReExpress(R).IsPhysicallyValid()
    full = M.ReExpress(R).CopyToFullMatrix6()
    assert (full == full.T).all(), "exactly symmetric"


@given(bodies(), masses, sizes, vectors)
def test_parallel_axis_theorem(M, mass, r, p):
    central = UnitInertia.SolidSphere(r)
    moved = central.ShiftFromCenterOfMass(p)
    same(moved.CopyToFullMatrix3(), central.CopyToFullMatrix3() + p @ p * np.eye(3) - np.outer(p, p))
    same(moved.ShiftToCenterOfMass(-p).CopyToFullMatrix3(), central.CopyToFullMatrix3())
    I = RotationalInertia(mass, p) + central * mass
    same(I.CopyToFullMatrix3(), (moved * mass).CopyToFullMatrix3())
    J = I.ShiftToThenAwayFromCenterOfMass(mass, -p, 2 * p)
    same(J.CopyToFullMatrix3(), (central.ShiftFromCenterOfMass(2 * p) * mass).CopyToFullMatrix3())


@given(bodies(), bodies())
def test_joined_bodies_add_their_momenta(M, N):
    both = SpatialInertia.Zero()
    both += M
    both += N
    assert both.IsPhysicallyValid()
    same(both.CopyToFullMatrix6(), M.CopyToFullMatrix6() + N.CopyToFullMatrix6(), 1e-10)


@given(bodies())
def test_ellipsoid_has_the_inertia_of_the_body(M):
    (a, b, c), X = M.CalcPrincipalSemiDiametersAndPoseForSolidEllipsoid()
    assert a >= b >= c
    twin = SpatialInertia.SolidEllipsoidWithMass(M.get_mass(), a, b, c).ReExpress(X.rotation())
    same(twin.Shift(-X.translation()).CopyToFullMatrix6(), M.CopyToFullMatrix6(), 1e-9)
