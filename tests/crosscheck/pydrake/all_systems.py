"""How to make one system of each class, with names that sheldrake and pydrake share."""

from __future__ import annotations

import importlib
from typing import Any

import numpy as np

ARM = """<robot name="arm"><link name="base"/><link name="l1"><inertial><mass value="1"/>
<inertia ixx="0.1" iyy="0.1" izz="0.1" ixy="0" ixz="0" iyz="0"/></inertial></link>
<joint name="j1" type="revolute"><parent link="base"/><child link="l1"/><axis xyz="0 1 0"/>
<limit lower="-3" upper="3" effort="5"/></joint>
<transmission name="t"><type>SimpleTransmission</type><joint name="j1"/><actuator name="a1"/></transmission></robot>"""


def arm(lib: Any, time_step: float = 0.0) -> Any:
    """A finalized plant of one joint."""
    plant = lib.MultibodyPlant(time_step)
    lib.Parser(plant).AddModelsFromString(ARM, "urdf")
    plant.WeldFrames(plant.world_frame(), plant.GetFrameByName("base"))
    plant.Finalize()
    return plant


def kept(owner: Any, *things: Any) -> Any:
    """`owner`, keeping things that it only refers to."""
    _alive.append((owner, things))
    return owner


_alive: list = []


def variable(lib: Any) -> Any:
    """A system of symbols."""
    x, u = lib.Variable("x"), lib.Variable("u")
    return lib.SymbolicVectorSystem(state=[x], input=[u], dynamics=[-x + lib.sin(u)], output=[x * x])


def scene(lib: Any, add: Any) -> Any:
    """What `add(builder, plant, scene_graph)` gives, of a diagram of an arm."""
    builder = lib.DiagramBuilder()
    plant, graph = lib.AddMultibodyPlantSceneGraph(builder, 1e-3)
    lib.Parser(plant).AddModelsFromString(ARM, "urdf")
    plant.Finalize()
    found = add(builder, plant, graph)
    return kept(found, builder, plant, graph)


def poly(lib: Any) -> Any:
    """A trajectory."""
    return lib.PiecewisePolynomial.FirstOrderHold([0.0, 1.0, 2.0], np.array([[0.0, 1.0, 0.5]]))


A, B, C, D = np.array([[0.0, 1.0], [-2.0, -0.3]]), np.array([[0.0], [1.0]]), np.eye(2), np.zeros((2, 1))

SYSTEMS = {
    "Adder": lambda s: s.Adder(2, 3),
    "AffineSystem": lambda s: s.AffineSystem(A, B, np.ones(2), C, D, np.zeros(2)),
    "BarycentricMeshSystem": lambda s: s.BarycentricMeshSystem(s.BarycentricMesh([{0.0, 1.0}]), np.array([[1.0, 2.0]])),
    "BusCreator": lambda s: s.BusCreator(),
    "BusSelector": lambda s: s.BusSelector(),
    "ConstantValueSource": lambda s: s.ConstantValueSource(s.Value(3)),
    "ConstantVectorSource": lambda s: s.ConstantVectorSource([1.0, 2.0]),
    "Demultiplexer": lambda s: s.Demultiplexer(4, 2),
    "DiscreteDerivative": lambda s: s.DiscreteDerivative(2, 0.1, False),
    "DiscreteTimeDelay": lambda s: s.DiscreteTimeDelay(0.1, 3, 2),
    "DiscreteTimeIntegrator": lambda s: s.DiscreteTimeIntegrator(2, 0.1),
    "FirstOrderLowPassFilter": lambda s: s.FirstOrderLowPassFilter(0.5, 2),
    "Gain": lambda s: s.Gain(2.0, 3),
    "Integrator": lambda s: s.Integrator(2),
    "LinearSystem": lambda s: s.LinearSystem(A, B, C, D, 0.1),
    "LinearTransformDensity": lambda s: s.LinearTransformDensity(s.RandomDistribution.kUniform, 2, 2),
    "MatrixGain": lambda s: s.MatrixGain(np.eye(2)),
    "MultilayerPerceptron": lambda s: s.MultilayerPerceptron([1, 3, 1]),
    "Multiplexer": lambda s: s.Multiplexer(3),
    "PassThrough": lambda s: s.PassThrough(2),
    "PassThrough abstract": lambda s: s.PassThrough(s.Value("a")),
    "PortSwitch": lambda s: s.PortSwitch(2),
    "RandomSource": lambda s: s.RandomSource(s.RandomDistribution.kGaussian, 2, 0.1),
    "Saturation": lambda s: s.Saturation([-1.0], [1.0]),
    "SharedPointerSystem": lambda s: s.SharedPointerSystem([1, 2]),
    "Sine": lambda s: s.Sine(1.0, 2.0, 0.3, 2),
    "SparseMatrixGain": lambda s: s.SparseMatrixGain(importlib.import_module("scipy.sparse").csc_matrix(np.eye(2))),
    "StateInterpolatorWithDiscreteDerivative": lambda s: s.StateInterpolatorWithDiscreteDerivative(2, 0.1, True),
    "SymbolicVectorSystem": variable,
    "TrajectoryAffineSystem": lambda s: s.TrajectoryAffineSystem(*(poly(s) for _ in range(6))),
    "TrajectoryLinearSystem": lambda s: s.TrajectoryLinearSystem(*(poly(s) for _ in range(4))),
    "TrajectorySource": lambda s: s.TrajectorySource(poly(s)),
    "VectorLogSink": lambda s: s.VectorLogSink(2),
    "WrapToSystem": lambda s: s.WrapToSystem(2),
    "ZeroOrderHold": lambda s: s.ZeroOrderHold(0.1, 2),
    "PidController": lambda s: s.PidController([1.0], [2.0], [3.0]),
    "InverseDynamics": lambda s: (lambda p: kept(s.InverseDynamics(p), p))(arm(s)),
    "InverseDynamicsController": lambda s: (
        lambda p: kept(s.InverseDynamicsController(p, [1.0], [0.0], [1.0], False), p)
    )(arm(s)),
    "JointStiffnessController": lambda s: (lambda p: kept(s.JointStiffnessController(p, [1.0], [1.0]), p))(arm(s)),
    "LuenbergerObserver": lambda s: (lambda p: kept(s.LuenbergerObserver(p, context_of(p), np.ones((2, 2))), p))(
        s.LinearSystem(A, B, C, D)
    ),
    "MultibodyPlant": arm,
    "MultibodyPlant discrete": lambda s: arm(s, 1e-3),
    "SceneGraph": lambda s: s.SceneGraph(),
    "SceneGraph of an arm": lambda s: scene(s, lambda b, p, g: g),
    "DrakeVisualizer": lambda s: s.DrakeVisualizer(),
    "MultibodyPositionToGeometryPose": lambda s: scene(s, lambda b, p, g: s.MultibodyPositionToGeometryPose(p)),
    "MultibodyPositionToGeometryPose of a state": lambda s: scene(
        s, lambda b, p, g: s.MultibodyPositionToGeometryPose(p, input_multibody_state=True)
    ),
    "Propeller": lambda s: s.Propeller(s.BodyIndex(1), thrust_ratio=1.0, moment_ratio=0.1),
    "Wing": lambda s: s.Wing(s.BodyIndex(1), surface_area=1.0, fluid_density=1.2),
    "ExternallyAppliedSpatialForceMultiplexer": lambda s: s.ExternallyAppliedSpatialForceMultiplexer(2),
    "Accelerometer": lambda s: (lambda p: kept(s.Accelerometer(p.GetBodyByName("l1"), s.RigidTransform()), p))(arm(s)),
    "Gyroscope": lambda s: (lambda p: kept(s.Gyroscope(p.GetBodyByName("l1"), s.RigidTransform()), p))(arm(s)),
    "RotaryEncoders": lambda s: s.RotaryEncoders(4, [0, 1]),
    "RotaryEncoders with ticks": lambda s: s.RotaryEncoders([7, 100]),
    "ImageWriter": lambda s: s.ImageWriter(),
    "LcmInterfaceSystem": lambda s: s.LcmInterfaceSystem(lcm=s.DrakeLcm()),
    "ContactResultsToLcmSystem": lambda s: (lambda p: kept(s.ContactResultsToLcmSystem(p), p))(arm(s, 1e-3)),
    "PointCloudConcatenation": lambda s: s.PointCloudConcatenation(["a", "b"]),
    "PointCloudToLcm": lambda s: s.PointCloudToLcm(),
    "DepthImageToPointCloud": lambda s: s.DepthImageToPointCloud(s.CameraInfo(640, 480, 1.0)),
    "SchunkWsgCommandReceiver": lambda s: s.SchunkWsgCommandReceiver(),
    "SchunkWsgCommandSender": lambda s: s.SchunkWsgCommandSender(),
    "SchunkWsgPositionController": lambda s: s.SchunkWsgPositionController(),
    "SchunkWsgStatusReceiver": lambda s: s.SchunkWsgStatusReceiver(),
    "SchunkWsgStatusSender": lambda s: s.SchunkWsgStatusSender(),
    "IiwaCommandReceiver": lambda s: s.IiwaCommandReceiver(),
    "IiwaCommandSender": lambda s: s.IiwaCommandSender(),
    "IiwaStatusReceiver": lambda s: s.IiwaStatusReceiver(),
    "IiwaStatusSender": lambda s: s.IiwaStatusSender(),
    "ColorizeDepthImage": lambda s: s.ColorizeDepthImage(),
    "ColorizeLabelImage": lambda s: s.ColorizeLabelImage(),
    "ConcatenateImages": lambda s: s.ConcatenateImages(),
    "RgbdSensor": lambda s: scene(
        s,
        lambda b, p, g: s.RgbdSensor(
            p.GetBodyFrameIdOrThrow(p.GetBodyByName("l1").index()),
            s.RigidTransform(),
            s.DepthRenderCamera(
                s.RenderCameraCore("r", s.CameraInfo(64, 48, 1.0), s.ClippingRange(0.1, 10.0), s.RigidTransform()),
                s.DepthRange(0.1, 5.0),
            ),
        ),
    ),
    "AcrobotPlant": lambda s: s.examples.AcrobotPlant(),
    "AcrobotSpongController": lambda s: s.examples.AcrobotSpongController(),
    "AcrobotWEncoder": lambda s: s.examples.AcrobotWEncoder(),
    "CompassGait": lambda s: s.examples.CompassGait(),
    "PendulumPlant": lambda s: s.examples.PendulumPlant(),
    "QuadrotorPlant": lambda s: s.examples.QuadrotorPlant(),
    "RimlessWheel": lambda s: s.examples.RimlessWheel(),
    "VanDerPolOscillator": lambda s: s.examples.VanDerPolOscillator(),
    "PidControlledSystem": lambda s: s.PidControlledSystem(s.LinearSystem(A, B, C, D), 1.0, 0.0, 1.0),
    "RobotDiagram": lambda s: s.RobotDiagramBuilder().Build(),
    "Diagram of an arm": lambda s: scene(s, lambda b, p, g: b.Build()),
    "Diagram of logs": lambda s: logs(s),
}


def context_of(system: Any) -> Any:
    """A context with its inputs fixed to zero."""
    context = system.CreateDefaultContext()
    for i in range(system.num_input_ports()):
        system.get_input_port(i).FixValue(context, np.zeros(system.get_input_port(i).size()))
    return context


def logs(lib: Any) -> Any:
    """A diagram of a source, a gain and a log."""
    builder = lib.DiagramBuilder()
    source = builder.AddSystem(lib.Sine(1.0, 2.0, 0.3, 1))
    gain = builder.AddSystem(lib.Gain(2.0, 1))
    builder.Connect(source.get_output_port(0), gain.get_input_port())
    lib.LogVectorOutput(gain.get_output_port(), builder)
    builder.ExportOutput(gain.get_output_port())
    return builder.Build()


class Library:
    """Names of `<package>.all`, and its examples."""

    def __init__(self, package: str):
        self.package = package
        self._all, self.examples = (importlib.import_module(f"{package}.{name}") for name in ("all", "examples"))

    def __getattr__(self, name: str) -> Any:
        return getattr(self._all, name)
