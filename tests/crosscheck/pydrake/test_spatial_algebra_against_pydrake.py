"""Spatial vectors and inertias give pydrake's numbers."""

import numpy as np
import pytest

from sheldrake.math import RollPitchYaw, RotationMatrix
from sheldrake.multibody import math as ours_math
from sheldrake.multibody.math import (
    RotationalInertia,
    SpatialAcceleration,
    SpatialInertia,
    SpatialVelocity,
    UnitInertia,
)

pm = pytest.importorskip("pydrake.multibody.math")
pt = pytest.importorskip("pydrake.multibody.tree")
pmath = pytest.importorskip("pydrake.math")
pytestmark = pytest.mark.peer
SEEDS = list(range(15))


def close(ours, theirs, tolerance=2e-14):
    theirs = np.asarray(theirs)
    np.testing.assert_allclose(ours, theirs, rtol=tolerance, atol=tolerance * max(1.0, np.abs(theirs).max()))


def pair(name, numbers):
    return getattr(ours_math, name)(numbers), getattr(pm, name)(numbers)


@pytest.mark.parametrize("seed", SEEDS)
def test_spatial_vectors(seed):
    rng = np.random.default_rng(seed)
    (V, pV), (U, pU) = pair("SpatialVelocity", rng.normal(size=6)), pair("SpatialVelocity", rng.normal(size=6))
    (A, pA), (B, pB) = pair("SpatialAcceleration", rng.normal(size=6)), pair("SpatialAcceleration", rng.normal(size=6))
    F, pF = pair("SpatialForce", rng.normal(size=6))
    L, pL = pair("SpatialMomentum", rng.normal(size=6))
    p, w, rpy = rng.normal(size=(3, 3))
    R, pR = RotationMatrix(RollPitchYaw(rpy)), pmath.RotationMatrix(pmath.RollPitchYaw(rpy))
    for ours, theirs in (
        (V.Shift(p), pV.Shift(p)),
        (F.Shift(p), pF.Shift(p)),
        (L.Shift(p), pL.Shift(p)),
        (A.Shift(p, w), pA.Shift(p, w)),
        (A.ShiftWithZeroAngularVelocity(p), pA.ShiftWithZeroAngularVelocity(p)),
        (V.ComposeWithMovingFrameVelocity(p, U), pV.ComposeWithMovingFrameVelocity(p, pU)),
        (
            A.ComposeWithMovingFrameAcceleration(p, w, V, B),
            pA.ComposeWithMovingFrameAcceleration(p, w, pV, pB),
        ),
        (F.Rotate(R), pF.Rotate(pR)),
        (V + U, pV + pU),
        (V - U, pV - pU),
        (-V * 2.5, -pV * 2.5),
    ):
        close(ours.get_coeffs(), theirs.get_coeffs())
        close(ours.rotational(), theirs.rotational())
        close(ours.translational(), theirs.translational())
    close([V @ F, F @ V, V.dot(L), L @ V], [pV @ pF, pF @ pV, pV.dot(pL), pL @ pV])
    for ours, theirs in ((V, pV), (A, pA), (F, pF), (L, pL)):
        assert repr(ours) == repr(theirs)


SHAPES = [
    ("SolidBox", (0.3, 0.5, 0.7), False),
    ("SolidCube", (0.4,), False),
    ("SolidSphere", (0.3,), False),
    ("HollowSphere", (0.3,), False),
    ("SolidEllipsoid", (0.3, 0.2, 0.5), False),
    ("SolidCylinder", (0.3, 0.8), True),
    ("SolidCylinderAboutEnd", (0.3, 0.8), True),
    ("SolidCapsule", (0.3, 0.8), True),
    ("ThinRod", (0.8,), True),
    ("AxiallySymmetric", (0.3, 0.8), True),
    ("StraightLine", (0.8,), True),
]
U = np.array([0.6, 0.0, 0.8])


@pytest.mark.parametrize("name, sizes, directed", SHAPES)
def test_unit_inertia_of_shapes(name, sizes, directed):
    arguments = (*sizes, U) if directed else sizes
    ours, theirs = getattr(UnitInertia, name)(*arguments), getattr(pt.UnitInertia, name)(*arguments)
    close(ours.CopyToFullMatrix3(), theirs.CopyToFullMatrix3(), 1e-15)


@pytest.mark.parametrize(
    "name, sizes, directed",
    [
        ("SolidBoxWithDensity", (2.0, 0.3, 0.5, 0.7), False),
        ("SolidBoxWithMass", (2.0, 0.3, 0.5, 0.7), False),
        ("SolidCubeWithDensity", (2.0, 0.3), False),
        ("SolidCapsuleWithDensity", (2.0, 0.3, 0.5), True),
        ("SolidCapsuleWithMass", (2.0, 0.3, 0.5), True),
        ("SolidCylinderWithDensity", (2.0, 0.3, 0.5), True),
        ("SolidCylinderWithDensityAboutEnd", (2.0, 0.3, 0.5), True),
        ("SolidCylinderWithMass", (2.0, 0.3, 0.5), True),
        ("SolidCylinderWithMassAboutEnd", (2.0, 0.3, 0.5), True),
        ("ThinRodWithMass", (2.0, 0.3), True),
        ("ThinRodWithMassAboutEnd", (2.0, 0.3), True),
        ("SolidEllipsoidWithDensity", (2.0, 0.3, 0.5, 0.7), False),
        ("SolidEllipsoidWithMass", (2.0, 0.3, 0.5, 0.7), False),
        ("SolidSphereWithDensity", (2.0, 0.3), False),
        ("SolidSphereWithMass", (2.0, 0.3), False),
        ("HollowSphereWithDensity", (2.0, 0.3), False),
        ("HollowSphereWithMass", (2.0, 0.3), False),
    ],
)
def test_spatial_inertia_of_shapes(name, sizes, directed):
    arguments = (*sizes, U) if directed else sizes
    ours, theirs = getattr(SpatialInertia, name)(*arguments), getattr(pt.SpatialInertia, name)(*arguments)
    close(ours.CopyToFullMatrix6(), theirs.CopyToFullMatrix6(), 1e-15)
    for k in range(len(sizes)):
        bad = [*arguments]
        bad[k] = -1.0
        with pytest.raises(RuntimeError, match="is not positive and finite: -1"):
            getattr(SpatialInertia, name)(*bad)
    if directed:
        with pytest.raises(RuntimeError, match="is not a unit vector"):
            getattr(SpatialInertia, name)(*sizes, 2 * U)


def random_bodies(rng, count=4):
    """Inertias of particles, about a point."""
    masses, places = rng.uniform(0.1, 2, size=count), rng.normal(size=(count, 3))
    mass, com = masses.sum(), masses @ places / masses.sum()
    G = sum(m * (p @ p * np.eye(3) - np.outer(p, p)) for m, p in zip(masses, places)) / mass
    return mass, com, (G[0, 0], G[1, 1], G[2, 2], G[0, 1], G[0, 2], G[1, 2])


@pytest.mark.parametrize("seed", SEEDS)
def test_inertia_algebra(seed):
    rng = np.random.default_rng(seed)
    mass, com, g = random_bodies(rng)
    mass2, com2, g2 = random_bodies(rng)
    M, pM = SpatialInertia(mass, com, UnitInertia(*g)), pt.SpatialInertia(mass, com, pt.UnitInertia(*g))
    N, pN = SpatialInertia(mass2, com2, UnitInertia(*g2)), pt.SpatialInertia(mass2, com2, pt.UnitInertia(*g2))
    p, rpy = rng.normal(size=(2, 3))
    R, pR = RotationMatrix(RollPitchYaw(rpy)), pmath.RotationMatrix(pmath.RollPitchYaw(rpy))
    close(M.Shift(p).CopyToFullMatrix6(), pM.Shift(p).CopyToFullMatrix6())
    close(M.ReExpress(R).CopyToFullMatrix6(), pM.ReExpress(pR).CopyToFullMatrix6())
    close(M.CalcRotationalInertia().CopyToFullMatrix3(), pM.CalcRotationalInertia().CopyToFullMatrix3())
    close(M.CalcComMoment(), pM.CalcComMoment())
    c = rng.normal(size=6)
    close((M * SpatialVelocity(c)).get_coeffs(), (pM * pm.SpatialVelocity(c)).get_coeffs())
    close((M * SpatialAcceleration(c)).get_coeffs(), (pM * pm.SpatialAcceleration(c)).get_coeffs())
    half_axes, pose = M.CalcPrincipalSemiDiametersAndPoseForSolidEllipsoid()
    p_half_axes, p_pose = pM.CalcPrincipalSemiDiametersAndPoseForSolidEllipsoid()
    close(half_axes, p_half_axes, 1e-12)
    close(pose.translation(), p_pose.translation())
    close(np.abs(pose.rotation().matrix()), np.abs(p_pose.rotation().matrix()), 1e-11)
    M += N
    pM += pN
    close(M.CopyToFullMatrix6(), pM.CopyToFullMatrix6())
    I, pI = RotationalInertia(*g), pt.RotationalInertia(*g)
    J, pJ = RotationalInertia(*g2), pt.RotationalInertia(*g2)
    for ours, theirs in (
        (I + J, pI + pJ),
        (I - J, pI - pJ),
        (I * 2, pI * 2),
        (3 * I, 3 * pI),
        (I / 2, pI / 2),
        (I.ReExpress(R), pI.ReExpress(pR)),
        (I.ShiftFromCenterOfMass(2, p), pI.ShiftFromCenterOfMass(2, p)),
        (I.ShiftToCenterOfMass(0.1, p), pI.ShiftToCenterOfMass(0.1, p)),
        (I.ShiftToThenAwayFromCenterOfMass(0.1, p, rpy), pI.ShiftToThenAwayFromCenterOfMass(0.1, p, rpy)),
        (UnitInertia(*g).ShiftFromCenterOfMass(p), pt.UnitInertia(*g).ShiftFromCenterOfMass(p)),
        (UnitInertia(*g).ShiftToCenterOfMass(p), pt.UnitInertia(*g).ShiftToCenterOfMass(p)),
        (RotationalInertia(mass, p), pt.RotationalInertia(mass, p)),
    ):
        close(ours.CopyToFullMatrix3(), theirs.CopyToFullMatrix3())
        close(ours.get_products(), theirs.get_products())
        close(ours.CalcPrincipalMomentsOfInertia(), theirs.CalcPrincipalMomentsOfInertia())
    close(I * p, pI * p)
    close([I.Trace(), I.CalcMaximumPossibleMomentOfInertia()], [pI.Trace(), pI.CalcMaximumPossibleMomentOfInertia()])
    assert I.IsNearlyEqualTo(J, 0.3) == pI.IsNearlyEqualTo(pJ, 0.3)


def test_the_same_inertias_are_valid():
    """Random numbers around the edge of validity: point masses, rods, plates, and near misses."""
    rng = np.random.default_rng(4)
    verdicts = []
    for i in range(400):
        com = rng.normal(size=3) * 10.0 ** rng.integers(-3, 3)
        moments = np.sort(rng.uniform(0, 1, size=3)) * 10.0 ** rng.integers(-6, 2)
        if i % 2:
            moments[2] = (moments[0] + moments[1]) * (1 + rng.normal() * 10.0 ** rng.integers(-17, -12))
        if i % 8 == 3:
            moments[:] = 0.0
        R = pmath.RotationMatrix(pmath.RollPitchYaw(rng.normal(size=3))).matrix()
        G = R @ np.diag(moments) @ R.T + (com @ com) * np.eye(3) - np.outer(com, com)
        six = (G[0, 0], G[1, 1], G[2, 2], G[0, 1], G[0, 2], G[1, 2])
        ours = SpatialInertia(1.0, com, UnitInertia(*six), skip_validity_check=True).IsPhysicallyValid()
        theirs = pt.SpatialInertia(1.0, com, pt.UnitInertia(*six), skip_validity_check=True).IsPhysicallyValid()
        verdicts.append((ours, theirs))
    differ = sum(a != b for a, b in verdicts)
    assert 50 < sum(b for _, b in verdicts) < 350, "the samples must lie on both sides"
    assert differ <= 8, f"{differ} of 400 differ: more than rounding on the edge explains"


def test_the_comparison_notices_a_planted_fault():
    """The wrong sign of the moment arm must not pass."""
    F, pF = pair("SpatialForce", np.arange(6.0))
    with pytest.raises(AssertionError):
        close(F.Shift([-1, -2, -3]).get_coeffs(), pF.Shift([1, 2, 3]).get_coeffs())
    M, pM = SpatialInertia.SolidBoxWithMass(1, 1, 2, 3), pt.SpatialInertia.SolidBoxWithMass(1, 1, 2, 3.0000001)
    with pytest.raises(AssertionError):
        close(M.CopyToFullMatrix6(), pM.CopyToFullMatrix6())
