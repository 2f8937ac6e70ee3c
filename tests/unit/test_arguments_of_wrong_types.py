"""An argument of the wrong type is a TypeError that says what was expected, never an error from within."""

import pytest

from sheldrake.geometry import GeometryId, Role, SceneGraph
from sheldrake.multibody.plant import MultibodyPlant
from sheldrake.multibody.tree import JacobianWrtVariable
from sheldrake.perception import PointCloud
from sheldrake.solvers import MathematicalProgram
from sheldrake.systems.analysis import Simulator
from sheldrake.systems.framework import BasicVector, DiagramBuilder
from sheldrake.systems.primitives import Adder
from sheldrake.trajectories import PiecewisePolynomial


def system():
    return Adder(1, 1)


def world(call, *arguments):
    """Calls a query of a plant without bodies, for a default context."""
    plant = MultibodyPlant(0.01)
    plant.Finalize()
    given = {"W": plant.world_frame(), "V": JacobianWrtVariable.kV, "p": [0.0, 0.0, 0.0]}
    return getattr(plant, call)(plant.CreateDefaultContext(), *(given.get(a, a) for a in arguments))


CALLS = {
    "frame of a Jacobian": lambda: world("CalcJacobianSpatialVelocity", "V", None, "p", "W", "W"),
    "frame of a pose": lambda: world("CalcRelativeTransform", "W", None),
    "frame of a center": lambda: world("CalcBiasCenterOfMassTranslationalAcceleration", "V", None, "W"),
    "points": lambda: world("CalcPointsPositions", "W", None, "W"),
    "forces": lambda: world("CalcGeneralizedForces", None),
    "variables of a cost": lambda: MathematicalProgram().AddL2NormCostUsingConicConstraint([[1.0]], [1.0], [3.0]),
    "index of an output": lambda: system().HasDirectFeedthrough("y"),
    "group of a state": lambda: system().CreateDefaultContext().get_discrete_state("x"),
    "context to copy": lambda: system().CreateDefaultContext().SetStateAndParametersFrom(3),
    "element of a vector": lambda: BasicVector(3).GetAtIndex("first"),
    "vector to add": lambda: BasicVector(3).PlusEqScaled(2.0, [1, 2, 3]),
    "system to remove": lambda: DiagramBuilder().RemoveSystem(None),
    "port to compare": lambda: DiagramBuilder().ConnectToSame(1, 2),
    "port to ask for": lambda: DiagramBuilder().IsConnectedOrExported("u"),
    "integrator": lambda: Simulator(system()).reset_integrator("euler"),
    "geometry": lambda: SceneGraph().model_inspector().GetShape("box"),
    "frame": lambda: SceneGraph().model_inspector().NumGeometriesForFrameWithRole(7, Role.kProximity),
    "pair": lambda: SceneGraph().model_inspector().CollisionFiltered(GeometryId.get_new_id(), None),
    "set of geometries": lambda: SceneGraph().model_inspector().GetGeometryIds("all"),
    "fields": lambda: PointCloud(3).SetFields("xyz"),
    "trajectory": lambda: PiecewisePolynomial([1.0]).isApprox(1.0, tol=1e-9),
}  # fmt: skip


@pytest.mark.parametrize("call", CALLS.values(), ids=CALLS)
def test_says_what_is_wrong_with_the_argument(call):
    with pytest.raises(TypeError, match=r"incompatible|cannot be interpreted"):
        call()
