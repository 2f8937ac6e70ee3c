"""Calls with a wrong argument raise what they raise in pydrake: TypeError, or what its C++ throws.

`tools/odd_calls.py` makes such calls of everything that is public; here is what it found, one line for each cause.
"""

from __future__ import annotations

import importlib

import numpy as np
import pytest

pytest.importorskip("pydrake")

from all_systems import Library, arm

pytestmark = pytest.mark.peer
LIBRARIES = {package: Library(package) for package in ("sheldrake", "pydrake")}
REFUSED = """
joint.AddInDamping(context, 'abc')
joint.set_velocity_limits(3, np.zeros(1))
joint.set_position_limits([1.0], 'abc')
plant.SetPositions(context, 3)
plant.CalcBiasCenterOfMassTranslationalAcceleration('abc', [], L.JacobianWrtVariable.kV, frame, frame)
body.Lock('abc')
L.AffineSystem(EYE, EYE, [0, 0], EYE, EYE, [0, 0]).UpdateCoefficients(3, EYE, [0, 0], EYE, EYE, [0, 0])
L.BasicVector([1.0, 2.0]).SetFromVector(3)
L.BarycentricMesh([{0.0, 1.0}]).Eval(EYE, None)
L.BsplineBasis(1, 10**30, L.KnotVectorType.kUniform, 0.0, 1.0)
L.BezierCurve(0.0, 1.0, EYE).BernsteinBasis(0, 0.5, 'abc')
L.BsplineTrajectory(L.BsplineBasis(2, 3), [np.ones((1, 1))] * 3).CopyBlock(0.5, 0, 1, 1)
L.ConvexHull([3])
L.Convex(L.InMemoryMesh(), 'abc')
L.Deterministic('abc')
L.DepthImageToPointCloud(3)
L.DiscreteTimeIntegrator(1, [0.1])
L.GeometryFrame('f', 'abc')
L.HPolyhedron.MakeUnitBox(2).FindRedundant([1.0])
L.IiwaStatusReceiver('abc')
L.LogVectorOutput(3, L.DiagramBuilder(), 0.1)
L.MathematicalProgram().NewBinaryVariables(10**30)
L.MathematicalProgram().NewContinuousVariables(10**30, 1)
L.MemoryFile(3, '.txt', 'x')
L.Obb.HasOverlap(None, None, None)
L.Obb.HasOverlap(BOX, BOX, np.zeros(3))
L.PiecewisePolynomial.CubicHermite({}, [[0.0, 1.0]], [[0.0, 1.0]])
L.PiecewisePolynomial.CubicShapePreserving([0.0, 1.0, 2.0], [[0.0, 1.0, 2.0]], L.Variable('a'))
L.PointCloud(3).Crop('abc', np.zeros(3))
L.ProximityProperties(other='abc')
L.RandomSource(3, 1, 0.1)
L.SimulatorStatus.IsIdenticalStatus(L.Simulator(L.Adder(1, 1)).AdvanceTo(0.1), 3)
L.TrajectoryAffineSystem(POLY, POLY, POLY, POLY, POLY, POLY).A('abc')
L.UniformlyRandomRotationMatrix('abc')
S.MakeMatrixBinaryVariable(10**30, 1, 'x')
S.MakeVectorBooleanVariable(10**30, 'x')
IK.PositionCost('abc', frame, [0, 0, 0], frame, [0, 0, 0], np.eye(3), context)
IK.AddUnitQuaternionConstraintOnPlant('abc', [L.Variable('a')], L.MathematicalProgram())
IK.DifferentialInverseKinematicsIntegrator(plant, frame, 'abc', PARAMETERS, context)
"""
"""What is a TypeError in both."""
THROWN = """
L.StateInterpolatorWithDiscreteDerivative(2, 0.1).set_initial_position(context.get_state(), [1.0, 2.0])
L.PiecewisePolynomial.ZeroOrderHold([0.0, 1.0], [])
L.Rgba(0.1, 0.2, 0.3).update(3)
L.L1NormCost(EYE, [0, 0]).UpdateCoefficients(EYE, [])
L.Rgba(0.1, 0.2, 0.3).set(3, 0.2, 0.3)
L.LogVectorOutput(L.Adder(1, 1).get_output_port(), L.DiagramBuilder(), np.int64(1))
L.RungeKutta2Integrator(L.Integrator(1), 0.1).set_target_accuracy(0.1)
"""
"""What is a RuntimeError in both."""
TAKEN = """
L.TrajectoryAffineSystem(POLY, POLY, POLY, POLY, POLY, POLY).A(1)
L.TrajectoryAffineSystem(POLY, POLY, POLY, POLY, POLY, POLY).f0(np.int64(1))
L.LinearConstraint(EYE, [0, 0], [1, 1]).CheckSatisfiedVectorized(np.zeros(2), 0.1)
plant.CalcSpatialMomentumInWorldAboutPoint(context, [INSTANCE], p_WoP_W=[1.0, 2.0, 3.0]).rotational()
len(PROG.AddScaledDiagonallyDominantDualConeMatrixConstraint(PROG.NewContinuousVariables(1)))
"""
"""What both take, and answer alike."""


def scope(package):
    lib = LIBRARIES[package]
    plant = arm(lib)
    inverse_kinematics = importlib.import_module(f"{package}.multibody.inverse_kinematics")
    return {
        "L": lib,
        "S": importlib.import_module(f"{package}.symbolic"),
        "IK": inverse_kinematics,
        "np": np,
        "EYE": np.eye(2),
        "BOX": lib.Obb(lib.RigidTransform(), [1.0, 1.0, 1.0]),
        "POLY": lib.PiecewisePolynomial.FirstOrderHold([0.0, 2.0], [[0.0, 1.0]]),
        "PROG": lib.MathematicalProgram(),
        "PARAMETERS": inverse_kinematics.DifferentialInverseKinematicsParameters(1, 1),
        "INSTANCE": lib.ModelInstanceIndex(2),
        "plant": plant,
        "context": plant.CreateDefaultContext(),
        "joint": plant.GetJointByName("j1"),
        "body": plant.GetBodyByName("l1"),
        "frame": plant.GetFrameByName("l1"),
    }


@pytest.fixture(scope="module")
def scopes():
    return {package: scope(package) for package in LIBRARIES}


def lines(text):
    return text.strip().split("\n")


@pytest.mark.parametrize("package", LIBRARIES)
@pytest.mark.parametrize("line", lines(REFUSED))
def test_refused(scopes, package, line):
    with pytest.raises(TypeError, match=r"incompatible|must be|cannot be|at most|from 0 to"):
        eval(line, scopes[package])


@pytest.mark.parametrize("package", LIBRARIES)
@pytest.mark.parametrize("line", lines(THROWN))
def test_thrown(scopes, package, line):
    with pytest.raises(RuntimeError):
        eval(line, scopes[package])


@pytest.mark.parametrize("line", lines(TAKEN))
def test_taken(scopes, line):
    ours, theirs = (eval(line, scopes[package]) for package in LIBRARIES)
    np.testing.assert_allclose(ours, theirs)
