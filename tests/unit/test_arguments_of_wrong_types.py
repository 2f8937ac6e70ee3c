"""An argument of the wrong type is a TypeError that says what was expected, never an error from within."""

import pytest

from sheldrake.geometry import ClippingRange, FrameId, GeometryId, RenderCameraCore, Role, SceneGraph
from sheldrake.math import RigidTransform
from sheldrake.multibody.plant import MultibodyPlant
from sheldrake.multibody.tree import JacobianWrtVariable
from sheldrake.perception import PointCloud
from sheldrake.solvers import MathematicalProgram
from sheldrake.systems.analysis import Simulator
from sheldrake.systems.controllers import LinearQuadraticRegulator
from sheldrake.systems.estimators import SteadyStateKalmanFilter
from sheldrake.systems.framework import BasicVector, DiagramBuilder
from sheldrake.systems.primitives import (
    Adder,
    Demultiplexer,
    DiscreteTimeDelay,
    FirstOrderLowPassFilter,
    Gain,
    MultilayerPerceptron,
    Multiplexer,
    Sine,
    ZeroOrderHold,
)
from sheldrake.systems.sensors import CameraInfo, ImageIo, ImageToLcmImageArrayT, RgbdSensor, RotaryEncoders
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
    "amplitude without the rest": lambda: Sine(1.0),
    "amplitude": lambda: Sine("a", 1.0, 0.0, 1),
    "one more": lambda: Sine(1.0, 1.0, 0.0, 1, True, 4),
    "layers": lambda: MultilayerPerceptron(),
    "layers and activations": lambda: MultilayerPerceptron([True, False], [4, 1]),
    "sizes of inputs": lambda: Multiplexer("ab"),
    "two kinds of sizes": lambda: Multiplexer(3, input_sizes=[1, 2]),
    "sizes of outputs": lambda: Demultiplexer(4, output_ports_sizes=[1, 2]),
    "factor without a size": lambda: Gain(2.0),
    "size of a filter with vectors": lambda: FirstOrderLowPassFilter([1.0, 2.0], 2),
    "size of a hold": lambda: ZeroOrderHold(0.1, 1.5),
    "size of a delay": lambda: DiscreteTimeDelay(0.1, 2),
    "ticks": lambda: RotaryEncoders("ab"),
    "image": lambda: ImageIo().Save(3, "a.png"),
    "file of an image": lambda: ImageIo().Load(3),
    "frames of images": lambda: ImageToLcmImageArrayT("color", "depth"),
    "cameras": lambda: RgbdSensor(FrameId.get_new_id(), RigidTransform()),
    "field of view": lambda: CameraInfo(10, 10, "wide"),
    "two lenses": lambda: CameraInfo(10, 10, 1.0, fov_y=1.0),
    "near plane": lambda: ClippingRange("near", 1.0),
    "pose of a camera": lambda: RenderCameraCore("vtk", CameraInfo(9, 9, 1.0), ClippingRange(0.1, 1.0), None),
    "matrices of a regulator": lambda: LinearQuadraticRegulator(1.0, 1.0, 1.0, 1.0),
    "context of a regulator": lambda: LinearQuadraticRegulator(system(), [[1.0]], [[1.0]]),
    "context of a filter": lambda: SteadyStateKalmanFilter(system(), [[1.0]], [[1.0]]),
    "trajectory": lambda: PiecewisePolynomial([1.0]).isApprox(1.0, tol=1e-9),
}  # fmt: skip


@pytest.mark.parametrize("call", CALLS.values(), ids=CALLS)
def test_says_what_is_wrong_with_the_argument(call):
    with pytest.raises(TypeError, match=r"incompatible|cannot be interpreted"):
        call()
