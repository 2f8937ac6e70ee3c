"""Odd but common arguments are taken as in pydrake: arrays of objects, columns, integers, parts for wholes."""

from __future__ import annotations

import importlib

import numpy as np
import pytest

pytest.importorskip("pydrake")

from all_systems import Library

pytestmark = pytest.mark.peer
LIBRARIES = [Library("sheldrake"), Library("pydrake")]
A, B, C, D = np.array([[1.0, 0.5], [0.0, -1.0]]), np.ones((2, 1)), np.eye(2), np.ones((2, 1))


def objects(array):
    return np.array(array, dtype=object)


def schema(lib):
    return importlib.import_module(f"{lib.package}.common.schema")


def rotation(lib):
    s = schema(lib)
    pose = s.Transform(translation=[1, 2, 3], rotation=s.Rotation.Rpy(deg=[10, 20, 30])).GetDeterministicValue()
    return pose.GetAsMatrix4()


def turned_later(lib):
    s = schema(lib)
    pose = s.Transform()
    pose.rotation = s.Rotation.AngleAxis(angle_deg=30, axis=[0, 0, 1])
    return pose.GetDeterministicValue().GetAsMatrix4()


def constant_polynomial(lib):
    prog = lib.MathematicalProgram()
    p, Q = prog.NewSosPolynomial(lib.Variables(prog.NewIndeterminates(2, "x")), 0)
    prog.AddLinearCost(p.ToExpression())
    return [Q.shape, str(Q[0, 0]), lib.Solve(prog).get_optimal_cost(), len(prog.GetAllConstraints())]


def columns(lib):
    system = lib.AffineSystem(A, B, np.zeros(2), C, D, np.zeros(2))
    system.UpdateCoefficients(A=2 * A, B=B, f0=np.ones((2, 1)), C=C, D=D, y0=np.full((2, 1), 3.0))
    return [system.A(), system.f0(), system.y0()]


def sparse(lib):
    gains = [lib.SparseMatrixGain(m) for m in (np.array([[1, 2], [3, 4]]), [[1, 2], [3, 4]])]
    gains[1].set_D(np.array([[5, 6], [7, 8]]))
    return [g.D().toarray() for g in gains] + [str(g.D().dtype) for g in gains]


def sampled(lib, scalar):
    system = lib.AffineSystem_[scalar](A, B, np.ones(2), C, D, np.ones(2))
    found = lib.DiscreteTimeApproximation(system, 0.1)
    x = found.CreateDefaultContext().get_discrete_state_vector().CopyToVector()
    return [found.A(), found.B(), found.f0(), x.dtype == object]


def sampled_duals(lib):
    """Of any system, with derivatives by the first state."""
    found = lib.DiscreteTimeApproximation(lib.examples.VanDerPolOscillator().ToAutoDiffXd(), 0.1)
    context = found.CreateDefaultContext()
    context.SetDiscreteState(lib.InitializeAutoDiff([1.0, 0.5]).ravel())
    x = found.EvalUniquePeriodicDiscreteUpdate(context).get_vector(0).CopyToVector()
    return [lib.ExtractValue(x), lib.ExtractGradient(x)]


def program(lib):
    prog = lib.MathematicalProgram()
    x = prog.NewContinuousVariables(2)
    prog.AddBoundingBoxConstraint(objects([0.0, 0.0]), objects([1.0, 1.0]), x)
    prog.AddLinearConstraint(objects(np.eye(2)), objects([0.0, 0.0]), objects([0.5, 1.0]), x)
    prog.AddQuadraticCost(objects(np.eye(2)), objects([-1.0, -1.0]), x)
    return np.round(lib.OsqpSolver().Solve(prog).GetSolution(x), 3)


def sets(lib):
    return [lib.HPolyhedron(objects(np.eye(2)), objects([1.0, 1.0])).b(), lib.Point(objects([1.0, 2.0])).x()]


def points(lib):
    plant = lib.MultibodyPlant(0.0)
    body = plant.AddRigidBody("b", lib.SpatialInertia(1.0, objects([0.0, 0.0, 0.0]), lib.UnitInertia.SolidSphere(0.1)))
    plant.Finalize()
    found = plant.CalcPointsPositions(
        plant.CreateDefaultContext(), body.body_frame(), objects([1.0, 2.0, 3.0]), plant.world_frame()
    )
    return [str(found.dtype), found]


CASES = {
    f.__name__: f
    for f in (rotation, turned_later, constant_polynomial, columns, sparse, sampled_duals, program, sets, points)
} | {
    f"sampled {s}": lambda lib, s=s: sampled(lib, getattr(lib, s, float)) for s in ("float", "AutoDiffXd", "Expression")
}


@pytest.mark.parametrize("name", CASES)
def test_taken_as_in_pydrake(name):
    ours, theirs = (CASES[name](lib) for lib in LIBRARIES)
    for a, b in zip(ours, theirs, strict=True):
        if isinstance(b, (str, tuple)):
            assert a == b
        else:
            np.testing.assert_allclose(np.array(a, dtype=float), np.array(b, dtype=float), rtol=1e-6, atol=1e-9)


@pytest.mark.parametrize(
    ("lacking", "call"),
    [
        ("all but A", lambda lib: lib.AffineSystem(A, B, np.ones(2), C, D, np.ones(2)).UpdateCoefficients(A=A)),
        ("a way to control it", lambda lib: lib.LinearQuadraticRegulator(np.eye(2), B, np.eye(2), np.eye(1))),
        ("the same", lambda lib: lib.ContinuousAlgebraicRiccatiEquation(np.eye(2), B, np.eye(2), np.eye(1))),
    ],
)
def test_refused_as_in_pydrake(lacking, call):
    for lib in LIBRARIES:
        with pytest.raises(RuntimeError):
            call(lib)


def test_what_no_feedback_stabilizes_in_discrete_time():
    """pydrake ends the process here."""
    lib = LIBRARIES[0]
    for call in (lib.DiscreteTimeLinearQuadraticRegulator, lib.DiscreteAlgebraicRiccatiEquation):
        with pytest.raises(RuntimeError, match="not stabilizable"):
            call(2.0 * np.eye(2), B, np.eye(2), np.eye(1))


def test_pixels_have_whole_numbers():
    for lib in LIBRARIES:
        image = lib.ImageDepth32F(3, 2)
        image.mutable_data[:] = np.arange(6.0).reshape(2, 3, 1)
        assert image.at(2, 1).tolist() == [5.0] and image.at(x=np.int64(1), y=0).tolist() == [1.0]
        with pytest.raises(TypeError):
            image.at(1.0, 0)
