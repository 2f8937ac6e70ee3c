"""Simulations as users write them, with all kinds of systems in the diagram: CPU time against Drake's.

    python benchmarks/simulations.py [TITLE ...] [--rounds 5] [--slower]

Each library runs in a process of its own. A line is what one function takes after its first calls, the best of several
rounds; `--slower` prints those lines only in which Drake is faster.
"""

from __future__ import annotations

import argparse
import importlib
import json
import pathlib
import subprocess
import sys
import time
import warnings
from collections.abc import Callable
from typing import Any

import numpy as np

ROOT = pathlib.Path(__file__).resolve().parents[1]
sys.path[:0] = [str(ROOT), str(ROOT / "src"), str(ROOT / "benchmarks" / "in_the_loop")]

from benchmarks.in_the_loop import _robots as robots  # noqa: E402
from benchmarks.turns import machine  # noqa: E402

PROGRAMS: dict[str, Callable[[Any], Callable[[], Any]]] = {}
SECONDS_A_ROUND = 0.25


def program(title: str) -> Callable:
    """Adds a function of the library that prepares what is timed and returns it."""

    def add(function: Callable) -> Callable:
        PROGRAMS[title] = function
        return function

    return add


def examples(lib: Any) -> Any:
    return importlib.import_module(f"{lib.__name__.split('.')[0]}.examples")


def again(lib: Any, diagram: Any, T: float, prepare: Callable[[Any], None] | None = None) -> Callable[[], None]:
    """Simulates a diagram from its beginning for T [s], again and again, with one simulator."""
    simulator = lib.Simulator(diagram)
    context = simulator.get_mutable_context()
    start = context.Clone()
    if prepare is not None:
        prepare(start)

    def run() -> None:
        context.SetTimeStateAndParametersFrom(start)
        simulator.Initialize()
        simulator.AdvanceTo(T)

    if prepare is not None:
        prepare(context)
    return run


# Systems of the library.


def _glider(lib: Any, step: float, multiplexed: bool = True) -> Callable[[], Any]:
    builder = lib.DiagramBuilder()
    plant, _ = lib.AddMultibodyPlantSceneGraph(builder, step)
    body = plant.AddRigidBody("glider", lib.SpatialInertia.SolidBoxWithMass(0.1, 0.3, 0.5, 0.02))
    plant.Finalize()
    places = ([0.02, 0.1, 0.0], [0.02, -0.1, 0.0], [-0.3, 0.0, 0.0]) if multiplexed else ([0.02, 0.0, 0.0],)
    if not multiplexed:
        lib.Wing.AddToBuilder(builder, plant, body.index(), 0.1, lib.RigidTransform(places[0]))
    else:
        mux = builder.AddSystem(lib.ExternallyAppliedSpatialForceMultiplexer(len(places)))
        for i, place in enumerate(places):
            one = builder.AddSystem(lib.Wing(body.index(), 0.05, lib.RigidTransform(place)))
            builder.Connect(plant.get_body_poses_output_port(), one.get_body_poses_input_port())
            builder.Connect(
                plant.get_body_spatial_velocities_output_port(), one.get_body_spatial_velocities_input_port()
            )
            builder.Connect(one.get_spatial_force_output_port(), mux.get_input_port(i))
        builder.Connect(mux.get_output_port(), plant.get_applied_spatial_force_input_port())
    diagram = builder.Build()

    def prepare(context: Any) -> None:
        mine = plant.GetMyMutableContextFromRoot(context)
        plant.SetFreeBodySpatialVelocity(body, lib.SpatialVelocity([0.0, 0.1, 0.0], [5.0, 0.0, 0.0]), mine)

    return again(lib, diagram, 0.5, prepare)


PROGRAMS["wing, continuous"] = lambda lib: _glider(lib, 0.0, False)
PROGRAMS["wing, discrete"] = lambda lib: _glider(lib, 1e-3, False)
PROGRAMS["three wings and a multiplexer, continuous"] = lambda lib: _glider(lib, 0.0)
PROGRAMS["three wings and a multiplexer, discrete"] = lambda lib: _glider(lib, 1e-3)


@program("propeller and wing, multiplexed")
def propeller_and_wing(lib: Any) -> Callable[[], Any]:
    builder = lib.DiagramBuilder()
    plant, _ = lib.AddMultibodyPlantSceneGraph(builder, 1e-3)
    body = plant.AddRigidBody("vehicle", lib.SpatialInertia.SolidBoxWithMass(0.1, 0.3, 0.5, 0.02))
    plant.Finalize()
    mux = builder.AddSystem(lib.ExternallyAppliedSpatialForceMultiplexer(2))
    propeller = builder.AddSystem(lib.Propeller(body.index(), lib.RigidTransform(), 1.0, 0.01))
    one = builder.AddSystem(lib.Wing(body.index(), 0.05))
    command = builder.AddSystem(lib.ConstantVectorSource([0.9]))
    builder.Connect(command.get_output_port(), propeller.get_command_input_port())
    builder.Connect(plant.get_body_poses_output_port(), propeller.get_body_poses_input_port())
    builder.Connect(plant.get_body_poses_output_port(), one.get_body_poses_input_port())
    builder.Connect(plant.get_body_spatial_velocities_output_port(), one.get_body_spatial_velocities_input_port())
    builder.Connect(propeller.get_spatial_forces_output_port(), mux.get_input_port(0))
    builder.Connect(one.get_spatial_force_output_port(), mux.get_input_port(1))
    builder.Connect(mux.get_output_port(), plant.get_applied_spatial_force_input_port())
    return again(lib, builder.Build(), 0.5)


@program("rimless wheel")
def rimless_wheel(lib: Any) -> Callable[[], Any]:
    wheel = examples(lib).RimlessWheel()

    def prepare(context: Any) -> None:
        context.SetContinuousState([0.0, 1.0])
        context.SetAccuracy(1e-4)

    return again(lib, wheel, 5.0, prepare)


@program("compass gait")
def compass_gait(lib: Any) -> Callable[[], Any]:
    gait = examples(lib).CompassGait()
    builder = lib.DiagramBuilder()
    builder.AddSystem(gait)
    torque = builder.AddSystem(lib.ConstantVectorSource([0.0]))
    builder.Connect(torque.get_output_port(), gait.get_input_port(0))

    def prepare(context: Any) -> None:
        gait.GetMyMutableContextFromRoot(context).SetContinuousState([0.0, 0.0, 0.4, -2.0])
        context.SetAccuracy(1e-4)

    return again(lib, builder.Build(), 3.0, prepare)


def _example(name: str, inputs: int, x0: list[float], T: float) -> None:
    @program(f"{name} of the examples")
    def example(lib: Any) -> Callable[[], Any]:
        system = getattr(examples(lib), name)()
        builder = lib.DiagramBuilder()
        builder.AddSystem(system)
        if inputs:
            source = builder.AddSystem(lib.ConstantVectorSource(np.full(inputs, 0.1)))
            builder.Connect(source.get_output_port(), system.get_input_port(0))
        diagram = builder.Build()

        def prepare(context: Any) -> None:
            system.GetMyMutableContextFromRoot(context).SetContinuousState(x0)

        return again(lib, diagram, T, prepare)


_example("PendulumPlant", 1, [1.0, 0.0], 5.0)
_example("AcrobotPlant", 1, [1.0, 0.0, 0.0, 0.0], 5.0)
_example("VanDerPolOscillator", 0, [1.0, 0.0], 5.0)
_example("QuadrotorPlant", 4, [0.1] * 12, 2.0)


def _double_integrator(lib: Any) -> Any:
    return lib.LinearSystem([[0.0, 1.0], [0.0, 0.0]], [[0.0], [1.0]], np.eye(2), np.zeros((2, 1)))


@program("FiniteHorizonLinearQuadraticRegulator")
def finite_horizon(lib: Any) -> Callable[[], Any]:
    system = examples(lib).PendulumPlant()
    context = system.CreateDefaultContext()
    context.SetContinuousState([np.pi, 0.0])
    system.get_input_port(0).FixValue(context, [0.0])
    options = lib.FiniteHorizonLinearQuadraticRegulatorOptions()
    options.Qf = np.eye(2)
    options.input_port_index = system.get_input_port().get_index()
    return lambda: lib.FiniteHorizonLinearQuadraticRegulator(
        system, context, 0.0, 5.0, np.diag([10.0, 1.0]), np.eye(1), options
    )


@program("simulation with the finite-horizon regulator")
def finite_horizon_loop(lib: Any) -> Callable[[], Any]:
    system = examples(lib).PendulumPlant()
    context = system.CreateDefaultContext()
    context.SetContinuousState([np.pi, 0.0])
    system.get_input_port(0).FixValue(context, [0.0])
    options = lib.FiniteHorizonLinearQuadraticRegulatorOptions()
    options.Qf = np.eye(2)
    options.input_port_index = system.get_input_port().get_index()
    builder = lib.DiagramBuilder()
    pendulum = builder.AddSystem(examples(lib).PendulumPlant())
    regulator = builder.AddSystem(
        lib.MakeFiniteHorizonLinearQuadraticRegulator(
            system, context, 0.0, 5.0, np.diag([10.0, 1.0]), np.eye(1), options
        )
    )
    builder.Connect(pendulum.get_state_output_port(), regulator.get_input_port(0))
    builder.Connect(regulator.get_output_port(), pendulum.get_input_port())

    def prepare(context: Any) -> None:
        pendulum.GetMyMutableContextFromRoot(context).SetContinuousState([np.pi + 0.1, 0.0])

    return again(lib, builder.Build(), 5.0, prepare)


@program("SymbolicVectorSystem")
def symbolic_system(lib: Any) -> Callable[[], Any]:
    x, v, u = (lib.Variable(n) for n in "xvu")
    system = lib.SymbolicVectorSystem(
        state=[x, v], input=[u], dynamics=[v, u - lib.sin(x) - 0.1 * v + v * v * x], output=[x, v * 2.0]
    )
    builder = lib.DiagramBuilder()
    builder.AddSystem(system)
    gain = builder.AddSystem(lib.Gain(np.array([-1.0])))
    demux = builder.AddSystem(lib.Demultiplexer(2, 1))
    builder.Connect(system.get_output_port(), demux.get_input_port())
    builder.Connect(demux.get_output_port(0), gain.get_input_port())
    builder.Connect(gain.get_output_port(), system.get_input_port())
    lib.LogVectorOutput(system.get_output_port(), builder, 0.02)

    def prepare(context: Any) -> None:
        system.GetMyMutableContextFromRoot(context).SetContinuousState([1.0, 0.0])

    return again(lib, builder.Build(), 5.0, prepare)


@program("SymbolicVectorSystem, discrete, with time and parameters")
def symbolic_discrete(lib: Any) -> Callable[[], Any]:
    t, x, v, a = (lib.Variable(n) for n in "txva")
    system = lib.SymbolicVectorSystem(
        time=t,
        state=[x, v],
        parameter=[a],
        dynamics=[x + 0.01 * v, v - 0.01 * (lib.sin(x) + a * v) + 0.001 * lib.cos(t)],
        output=[x],
        time_period=0.01,
    )
    return again(lib, system, 5.0, lambda context: context.SetDiscreteState([1.0, 0.0]))


@program("cart-pole with a planar visualizer")
def planar_visualizer(lib: Any) -> Callable[[], Any]:
    import matplotlib

    matplotlib.use("Agg")
    from matplotlib import pyplot

    builder = lib.DiagramBuilder()
    plant, scene_graph = lib.AddMultibodyPlantSceneGraph(builder, 0.0)
    lib.Parser(plant).AddModelsFromString(robots.cart_pole(), "urdf")
    plant.Finalize()
    axes = pyplot.subplots()[1]
    lib.ConnectPlanarSceneGraphVisualizer(builder, scene_graph, xlim=[-2.0, 2.0], ylim=[-1.0, 2.0], ax=axes, show=False)
    source = builder.AddSystem(lib.ConstantVectorSource([0.0]))
    builder.Connect(source.get_output_port(), plant.get_actuation_input_port())
    return again(lib, builder.Build(), 0.5)


@program("TrajectorySource and a PID-controlled double integrator")
def trajectory_source(lib: Any) -> Callable[[], Any]:
    builder = lib.DiagramBuilder()
    path = lib.PiecewisePolynomial.CubicShapePreserving(
        np.linspace(0, 5, 11), np.sin(np.linspace(0, 5, 11))[None], True
    )
    source = builder.AddSystem(lib.TrajectorySource(path, 1))
    system = builder.AddSystem(_double_integrator(lib))
    controller = builder.AddSystem(lib.PidController([10.0], [1.0], [5.0]))
    builder.Connect(source.get_output_port(), controller.get_input_port_desired_state())
    builder.Connect(system.get_output_port(), controller.get_input_port_estimated_state())
    builder.Connect(controller.get_output_port(), system.get_input_port())
    lib.LogVectorOutput(system.get_output_port(), builder)
    return again(lib, builder.Build(), 5.0)


@program("TrajectoryAffineSystem, continuous")
def trajectory_affine(lib: Any) -> Callable[[], Any]:
    times = [0.0, 1.0, 2.0, 5.0]

    def path(rows: int, cols: int) -> Any:
        rng = np.random.default_rng(rows + 10 * cols)
        return lib.PiecewisePolynomial.CubicShapePreserving(
            times, [rng.uniform(-1, 1, (rows, cols)) for _ in times], True
        )

    system = lib.TrajectoryAffineSystem(path(2, 2), path(2, 1), path(2, 1), path(1, 2), path(1, 1), path(1, 1))
    builder = lib.DiagramBuilder()
    builder.AddSystem(system)
    source = builder.AddSystem(lib.Sine(1.0, 2.0, 0.0, 1))
    builder.Connect(source.get_output_port(0), system.get_input_port())
    lib.LogVectorOutput(system.get_output_port(), builder, 0.05)
    return again(lib, builder.Build(), 5.0)


@program("TrajectoryLinearSystem, discrete")
def trajectory_linear(lib: Any) -> Callable[[], Any]:
    times = [0.0, 1.0, 2.0, 5.0]

    def path(rows: int, cols: int) -> Any:
        rng = np.random.default_rng(rows + 10 * cols)
        return lib.PiecewisePolynomial.FirstOrderHold(times, [rng.uniform(-0.3, 0.3, (rows, cols)) for _ in times])

    system = lib.TrajectoryLinearSystem(path(2, 2), path(2, 1), path(1, 2), path(1, 1), 0.01)
    builder = lib.DiagramBuilder()
    builder.AddSystem(system)
    source = builder.AddSystem(lib.ConstantVectorSource([1.0]))
    builder.Connect(source.get_output_port(0), system.get_input_port())
    return again(lib, builder.Build(), 5.0)


def _fed(make: Callable[[Any], Any], inputs: Callable[[Any], list[Any]], T: float = 2.0, period: float = 0.01) -> Any:
    """Prepares a system of the library with sources at its inputs and a log at its first output."""

    def prepare(lib: Any) -> Callable[[], Any]:
        builder = lib.DiagramBuilder()
        system = builder.AddSystem(make(lib))
        for i, source in enumerate(inputs(lib)):
            builder.AddSystem(source)
            builder.Connect(source.get_output_port(0), system.get_input_port(i))
        lib.LogVectorOutput(system.get_output_port(0), builder, period)
        return again(lib, builder.Build(), T)

    return prepare


def _sine(size: int) -> Callable[[Any], list[Any]]:
    return lambda lib: [lib.Sine(1.0, 2.0, 0.1, size)]


def _gaussian(lib: Any) -> Any:
    return lib.RandomSource(lib.RandomDistribution.kGaussian, 2, 0.01)


def _barycentric(lib: Any) -> Any:
    return lib.BarycentricMeshSystem(
        lib.BarycentricMesh([{-2.0, -1.0, 0.0, 1.0, 2.0}, {-2.0, 0.0, 2.0}]), np.arange(15.0)[None]
    )


def _approximation(lib: Any) -> Any:
    return lib.DiscreteTimeApproximation(_double_integrator(lib), 0.01)


PROGRAMS["RandomSource at 100 Hz"] = _fed(_gaussian, lambda lib: [])
PROGRAMS["BarycentricMeshSystem"] = _fed(_barycentric, _sine(2))
PROGRAMS["DiscreteTimeApproximation of a linear system"] = _fed(_approximation, _sine(1))
PROGRAMS["DiscreteTimeDelay"] = _fed(lambda lib: lib.DiscreteTimeDelay(0.01, 10, 2), _sine(2))
PROGRAMS["DiscreteDerivative"] = _fed(lambda lib: lib.DiscreteDerivative(2, 0.01), _sine(2))
PROGRAMS["StateInterpolatorWithDiscreteDerivative"] = _fed(
    lambda lib: lib.StateInterpolatorWithDiscreteDerivative(2, 0.01), _sine(2)
)
PROGRAMS["FirstOrderLowPassFilter"] = _fed(lambda lib: lib.FirstOrderLowPassFilter(0.1, 2), _sine(2))
PROGRAMS["WrapToSystem"] = _fed(lambda lib: lib.WrapToSystem(2), _sine(2))
PROGRAMS["VanDerPolOscillator, its position logged"] = _fed(
    lambda lib: examples(lib).VanDerPolOscillator(), lambda lib: [], 5.0
)
PROGRAMS["MultilayerPerceptron"] = _fed(lambda lib: lib.MultilayerPerceptron([2, 16, 1]), _sine(2))


@program("Luenberger observer of a pendulum")
def luenberger(lib: Any) -> Callable[[], Any]:
    builder = lib.DiagramBuilder()
    plant = builder.AddSystem(_double_integrator(lib))
    observed = _double_integrator(lib)
    context = observed.CreateDefaultContext()
    observed.get_input_port().FixValue(context, [0.0])
    observer = builder.AddSystem(lib.LuenbergerObserver(observed, context, np.array([[1.0, 0.1], [0.1, 1.0]])))
    source = builder.AddSystem(lib.Sine(1.0, 2.0, 0.1, 1))
    builder.Connect(source.get_output_port(0), plant.get_input_port())
    builder.Connect(source.get_output_port(0), observer.get_observed_system_input_input_port())
    builder.Connect(plant.get_output_port(), observer.get_observed_system_output_input_port())
    lib.LogVectorOutput(observer.get_estimated_state_output_port(), builder, 0.01)
    return again(lib, builder.Build(), 2.0)


@program("accelerometer and gyroscope on a continuous pendulum")
def inertial(lib: Any) -> Callable[[], Any]:
    builder = lib.DiagramBuilder()
    plant, _ = lib.AddMultibodyPlantSceneGraph(builder, 0.0)
    lib.Parser(plant).AddModelsFromString(robots.cart_pole(), "urdf")
    plant.Finalize()
    body = plant.get_body(lib.BodyIndex(plant.num_bodies() - 1))
    gravity, here = plant.gravity_field().gravity_vector(), lib.RigidTransform([0.0, 0.0, -0.1])
    accelerometer = builder.AddSystem(lib.Accelerometer(body, here, gravity))
    gyroscope = builder.AddSystem(lib.Gyroscope(body, here))
    for sensor in (accelerometer, gyroscope):
        builder.Connect(plant.get_body_poses_output_port(), sensor.get_body_poses_input_port())
        builder.Connect(plant.get_body_spatial_velocities_output_port(), sensor.get_body_velocities_input_port())
    builder.Connect(
        plant.get_body_spatial_accelerations_output_port(), accelerometer.get_body_accelerations_input_port()
    )
    source = builder.AddSystem(lib.ConstantVectorSource([0.0]))
    builder.Connect(source.get_output_port(), plant.get_actuation_input_port())
    lib.LogVectorOutput(accelerometer.get_measurement_output_port(), builder, 0.01)
    lib.LogVectorOutput(gyroscope.get_measurement_output_port(), builder, 0.01)
    return again(lib, builder.Build(), 1.0)


@program("a bus")
def buses(lib: Any) -> Callable[[], Any]:
    builder = lib.DiagramBuilder()
    source = builder.AddSystem(lib.Sine(1.0, 2.0, 0.1, 2))
    creator, selector = builder.AddSystem(lib.BusCreator()), builder.AddSystem(lib.BusSelector())
    creator.DeclareVectorInputPort("x", 2)
    selector.DeclareVectorOutputPort("x", 2)
    builder.Connect(source.get_output_port(0), creator.get_input_port(0))
    builder.Connect(creator.get_output_port(), selector.get_input_port())
    lib.LogVectorOutput(selector.get_output_port(0), builder, 0.01)
    return again(lib, builder.Build(), 2.0)


@program("cart-pole with an LQR and a drawn planar visualizer")
def drawn(lib: Any) -> Callable[[], Any]:
    import matplotlib

    matplotlib.use("Agg")
    from matplotlib import pyplot

    builder = lib.DiagramBuilder()
    plant, scene_graph = lib.AddMultibodyPlantSceneGraph(builder, 0.0)
    lib.Parser(plant).AddModelsFromString(robots.cart_pole(), "urdf")
    plant.Finalize()
    axes = pyplot.subplots()[1]
    visualizer = lib.ConnectPlanarSceneGraphVisualizer(
        builder, scene_graph, xlim=[-2.0, 2.0], ylim=[-1.0, 2.0], ax=axes, show=True
    )
    controller = builder.AddSystem(lib.MatrixGain(np.array([[1.0, 50.0, 2.0, 10.0]])))
    builder.Connect(plant.get_state_output_port(), controller.get_input_port())
    builder.Connect(controller.get_output_port(), plant.get_actuation_input_port())
    run = again(lib, builder.Build(), 1.0)

    def recorded() -> None:
        visualizer.start_recording()
        run()
        visualizer.stop_recording()
        visualizer.reset_recording()

    return recorded


# Around a simulation.


def _linear_diagram(lib: Any) -> Any:
    builder = lib.DiagramBuilder()
    system = builder.AddSystem(_double_integrator(lib))
    gain = builder.AddSystem(lib.MatrixGain(np.array([[-1.0, -1.0]])))
    builder.Connect(system.get_output_port(), gain.get_input_port())
    builder.Connect(gain.get_output_port(), system.get_input_port())
    log = lib.LogVectorOutput(system.get_output_port(), builder, 0.01)
    return builder.Build(), system, log


def _arm_diagram(lib: Any, step: float) -> Any:
    builder = lib.DiagramBuilder()
    plant, _scene_graph = lib.AddMultibodyPlantSceneGraph(builder, step)
    lib.Parser(plant).AddModelsFromString(robots.arm(), "urdf")
    plant.Finalize()
    source = builder.AddSystem(lib.ConstantVectorSource(np.zeros(7)))
    builder.Connect(source.get_output_port(), plant.get_actuation_input_port())
    log = lib.LogVectorOutput(plant.get_state_output_port(), builder, 0.01)
    return builder.Build(), plant, log


@program("Initialize, linear system")
def initialize_linear(lib: Any) -> Callable[[], Any]:
    return lib.Simulator(_linear_diagram(lib)[0]).Initialize


@program("Initialize, arm")
def initialize_arm(lib: Any) -> Callable[[], Any]:
    return lib.Simulator(_arm_diagram(lib, 1e-3)[0]).Initialize


@program("Initialize, continuous arm")
def initialize_continuous_arm(lib: Any) -> Callable[[], Any]:
    return lib.Simulator(_arm_diagram(lib, 0.0)[0]).Initialize


@program("AdvanceTo the present time")
def advance_to_now(lib: Any) -> Callable[[], Any]:
    simulator = lib.Simulator(_linear_diagram(lib)[0])
    simulator.Initialize()
    return lambda: simulator.AdvanceTo(0.0)


@program("AdvancePendingEvents")
def advance_pending(lib: Any) -> Callable[[], Any]:
    simulator = lib.Simulator(_linear_diagram(lib)[0])
    simulator.Initialize()
    return simulator.AdvancePendingEvents


@program("AdvanceTo, one step of an arm")
def advance_one_step(lib: Any) -> Callable[[], Any]:
    simulator = lib.Simulator(_arm_diagram(lib, 1e-3)[0])
    simulator.Initialize()
    context = simulator.get_context()
    return lambda: simulator.AdvanceTo(context.get_time() + 1e-3)


@program("reset and a short run of a linear system")
def reset_and_run(lib: Any) -> Callable[[], Any]:
    diagram, _system, log = _linear_diagram(lib)
    simulator = lib.Simulator(diagram)
    context = simulator.get_mutable_context()

    def run() -> None:
        context.SetTime(0.0)
        context.SetContinuousState([1.0, 0.0])
        simulator.Initialize()
        log.FindMutableLog(context).Clear()
        simulator.AdvanceTo(0.1)
        log.FindLog(context).data()

    return run


@program("a new simulator and a short run")
def new_simulator(lib: Any) -> Callable[[], Any]:
    diagram, _system, log = _linear_diagram(lib)

    def run() -> None:
        simulator = lib.Simulator(diagram)
        context = simulator.get_mutable_context()
        context.SetContinuousState([1.0, 0.0])
        simulator.Initialize()
        simulator.AdvanceTo(0.1)
        log.FindLog(context).data()

    return run


@program("a new simulator of an arm and a short run")
def new_arm_simulator(lib: Any) -> Callable[[], Any]:
    diagram, plant, log = _arm_diagram(lib, 1e-3)

    def run() -> None:
        simulator = lib.Simulator(diagram)
        context = simulator.get_mutable_context()
        plant.SetPositions(plant.GetMyMutableContextFromRoot(context), np.full(7, 0.1))
        simulator.AdvanceTo(0.1)
        log.FindLog(context).data()

    return run


def _filled_log(lib: Any) -> Any:
    diagram, _, log = _linear_diagram(lib)
    simulator = lib.Simulator(diagram)
    simulator.AdvanceTo(1.0)
    found = log.FindLog(simulator.get_context())
    return simulator, found, log


@program("log.data()")
def log_data(lib: Any) -> Callable[[], Any]:
    keep = _filled_log(lib)
    return lambda: keep[1].data()


@program("log.sample_times()")
def log_times(lib: Any) -> Callable[[], Any]:
    keep = _filled_log(lib)
    return lambda: keep[1].sample_times()


@program("log.FindLog(context)")
def find_log(lib: Any) -> Callable[[], Any]:
    simulator, _, log = _filled_log(lib)
    context = simulator.get_context()
    return lambda: log.FindLog(context)


@program("EvalTimeDerivatives, linear")
def derivatives_linear(lib: Any) -> Callable[[], Any]:
    diagram = _linear_diagram(lib)[0]
    context = diagram.CreateDefaultContext()

    def run() -> None:
        context.SetContinuousState([1.0, 0.0])
        diagram.EvalTimeDerivatives(context).CopyToVector()

    return run


@program("EvalTimeDerivatives, unchanged")
def derivatives_unchanged(lib: Any) -> Callable[[], Any]:
    diagram = _linear_diagram(lib)[0]
    context = diagram.CreateDefaultContext()
    return lambda: diagram.EvalTimeDerivatives(context)


@program("EvalTimeDerivatives, pendulum")
def derivatives_pendulum(lib: Any) -> Callable[[], Any]:
    pendulum = examples(lib).PendulumPlant()
    context = pendulum.CreateDefaultContext()
    pendulum.get_input_port(0).FixValue(context, [0.1])
    x = np.array([0.1, 0.2])

    def run() -> None:
        context.SetContinuousState(x)
        pendulum.EvalTimeDerivatives(context).CopyToVector()

    return run


@program("EvalTimeDerivatives, arm")
def derivatives_arm(lib: Any) -> Callable[[], Any]:
    diagram = _arm_diagram(lib, 0.0)[0]
    context = diagram.CreateDefaultContext()
    x = np.full(14, 0.1)

    def run() -> None:
        context.SetContinuousState(x)
        diagram.EvalTimeDerivatives(context).CopyToVector()

    return run


@program("CalcTimeDerivatives, pendulum")
def calc_derivatives_pendulum(lib: Any) -> Callable[[], Any]:
    pendulum = examples(lib).PendulumPlant()
    context = pendulum.CreateDefaultContext()
    pendulum.get_input_port(0).FixValue(context, [0.1])
    derivatives = pendulum.AllocateTimeDerivatives()
    x = np.array([0.1, 0.2])

    def run() -> None:
        context.SetContinuousState(x)
        pendulum.CalcTimeDerivatives(context, derivatives)

    return run


def _falling(lib: Any, step: float) -> Any:
    builder = lib.DiagramBuilder()
    plant, _scene_graph = lib.AddMultibodyPlantSceneGraph(builder, step)
    lib.Parser(plant).AddModelsFromString(robots.table(), "urdf")
    lib.Parser(plant).AddModelsFromString(robots.box("one"), "urdf")
    plant.Finalize()
    diagram = builder.Build()
    context = diagram.CreateDefaultContext()
    mine = plant.GetMyMutableContextFromRoot(context)
    body = plant.GetBodyByName("one")
    plant.SetFreeBodyPose(mine, body, lib.RigidTransform([0.5, 0.0, 0.0299]))
    return diagram, plant, context, mine, body


def _contact_results(step: float) -> Callable[[Any], Callable[[], Any]]:
    def prepare(lib: Any) -> Callable[[], Any]:
        diagram, plant, context, mine, body = _falling(lib, step)
        poses = [lib.RigidTransform([0.5, 0.0, z]) for z in (0.0299, 0.0298)]
        turn = [0]
        port = plant.get_contact_results_output_port()

        def run() -> None:
            turn[0] ^= 1
            plant.SetFreeBodyPose(mine, body, poses[turn[0]])
            results = port.Eval(mine)
            for i in range(results.num_point_pair_contacts()):
                results.point_pair_contact_info(i).contact_force()

        run.keep = diagram, context
        return run

    return prepare


PROGRAMS["contact_results of a continuous plant"] = _contact_results(0.0)
PROGRAMS["contact_results of a discrete plant"] = _contact_results(1e-3)


def _plant_port(name: str, step: float) -> Callable[[Any], Callable[[], Any]]:
    def prepare(lib: Any) -> Callable[[], Any]:
        builder = lib.DiagramBuilder()
        plant, _ = lib.AddMultibodyPlantSceneGraph(builder, step)
        lib.Parser(plant).AddModelsFromString(robots.arm(), "urdf")
        plant.Finalize()
        diagram = builder.Build()
        context = diagram.CreateDefaultContext()
        mine = plant.GetMyMutableContextFromRoot(context)
        plant.get_actuation_input_port().FixValue(mine, np.zeros(7))
        port, x = plant.GetOutputPort(name), np.full(14, 0.1)

        def run() -> None:
            plant.SetPositionsAndVelocities(mine, x)
            port.Eval(mine)

        run.keep = diagram, context
        return run

    return prepare


for _port in (
    "net_actuation",
    "body_poses",
    "body_spatial_velocities",
    "body_spatial_accelerations",
    "generalized_acceleration",
    "reaction_forces",
    "state",
    "arm_generalized_contact_forces",
    "contact_results",
):
    PROGRAMS[f"port {_port} after a write, discrete"] = _plant_port(_port, 1e-3)
    if _port != "arm_generalized_contact_forces":
        PROGRAMS[f"port {_port} after a write, continuous"] = _plant_port(_port, 0.0)


@program("vector_values")
def vector_values(lib: Any) -> Callable[[], Any]:
    path = lib.PiecewisePolynomial.CubicShapePreserving(
        np.linspace(0, 5, 11), np.sin(np.linspace(0, 5, 11))[None], True
    )
    times = np.linspace(0.0, 5.0, 30)
    return lambda: path.vector_values(times)


@program("vector_values of seven rows")
def vector_values_seven(lib: Any) -> Callable[[], Any]:
    breaks = np.linspace(0, 5, 11)
    path = lib.PiecewisePolynomial.CubicShapePreserving(breaks, np.sin(breaks + np.arange(7.0)[:, None]), True)
    times = np.linspace(0.0, 5.0, 100)
    return lambda: path.vector_values(times)


@program("vector_values of a B-spline")
def vector_values_spline(lib: Any) -> Callable[[], Any]:
    basis = lib.BsplineBasis(4, 10)
    path = lib.BsplineTrajectory(basis, np.sin(np.arange(10.0))[None] * np.ones((7, 1)))
    times = np.linspace(0.0, 1.0, 100)
    return lambda: path.vector_values(times)


@program("SetTimeStateAndParametersFrom, linear")
def set_from_linear(lib: Any) -> Callable[[], Any]:
    diagram = _linear_diagram(lib)[0]
    context, other = diagram.CreateDefaultContext(), diagram.CreateDefaultContext()
    return lambda: context.SetTimeStateAndParametersFrom(other)


@program("SetTimeStateAndParametersFrom, arm")
def set_from_arm(lib: Any) -> Callable[[], Any]:
    diagram = _arm_diagram(lib, 1e-3)[0]
    context, other = diagram.CreateDefaultContext(), diagram.CreateDefaultContext()
    return lambda: context.SetTimeStateAndParametersFrom(other)


@program("context.Clone(), arm")
def clone_arm(lib: Any) -> Callable[[], Any]:
    diagram = _arm_diagram(lib, 1e-3)[0]
    return diagram.CreateDefaultContext().Clone


@program("MonteCarloSimulation")
def monte_carlo(lib: Any) -> Callable[[], Any]:
    def make(generator: Any) -> Any:
        return lib.Simulator(_linear_diagram(lib)[0])

    def output(system: Any, context: Any) -> float:
        return context.get_continuous_state_vector()[0]

    return lambda: lib.MonteCarloSimulation(make, output, 0.2, 20, lib.RandomGenerator(1))


@program("RandomSimulation of one diagram")
def random_simulation(lib: Any) -> Callable[[], Any]:
    diagram = _linear_diagram(lib)[0]
    generator = lib.RandomGenerator(1)

    def make(generator: Any) -> Any:
        return lib.Simulator(diagram)

    def output(system: Any, context: Any) -> float:
        return context.get_continuous_state_vector()[0]

    return lambda: lib.RandomSimulation(make, output, 0.2, generator)


# Systems in Python.


def _with_arm(lib: Any, step: float, add: Callable[[Any, Any, Any], None], T: float = 0.2) -> Callable[[], Any]:
    builder = lib.DiagramBuilder()
    plant, scene_graph = lib.AddMultibodyPlantSceneGraph(builder, step)
    lib.Parser(plant).AddModelsFromString(robots.arm(), "urdf")
    lib.Parser(plant).AddModelsFromString(robots.table(), "urdf")
    lib.Parser(plant).AddModelsFromString(robots.box("one"), "urdf")
    plant.SetDefaultFloatingBaseBodyPose(plant.GetBodyByName("one"), lib.RigidTransform([0.5, 0.0, 0.03]))
    plant.Finalize()
    add(builder, plant, scene_graph)
    if not builder.connection_map() or not any(
        system is plant and index == plant.get_actuation_input_port().get_index()
        for system, index in ((k[0], k[1]) for k in builder.connection_map())
    ):
        source = builder.AddSystem(lib.ConstantVectorSource(np.zeros(7)))
        builder.Connect(source.get_output_port(), plant.get_actuation_input_port())
    return again(lib, builder.Build(), T)


def _joint_controller(lib: Any, period: float) -> Any:
    class Controller(lib.LeafSystem):
        def __init__(self) -> None:
            super().__init__()
            self.DeclareVectorInputPort("x", 27)
            self.DeclareVectorInputPort("desired", 7)
            self._held = self.DeclareDiscreteState(7)
            self.DeclareStateOutputPort("tau", self._held)
            self.DeclarePeriodicDiscreteUpdateEvent(period, 0.0, self._update)

        def _update(self, context: Any, discrete: Any) -> None:
            x = self.get_input_port(0).Eval(context)
            desired = self.get_input_port(1).Eval(context)
            discrete.set_value(0, 20.0 * (desired - x[7:14]) - 2.0 * x[20:27])

    return Controller()


@program("Python discrete controller at 1 kHz")
def python_discrete(lib: Any) -> Callable[[], Any]:
    def add(builder: Any, plant: Any, scene_graph: Any) -> None:
        controller = builder.AddSystem(_joint_controller(lib, 1e-3))
        desired = builder.AddSystem(lib.ConstantVectorSource(np.zeros(7)))
        builder.Connect(plant.get_state_output_port(), controller.get_input_port(0))
        builder.Connect(desired.get_output_port(), controller.get_input_port(1))
        builder.Connect(controller.get_output_port(), plant.get_actuation_input_port())

    return _with_arm(lib, 1e-3, add)


def _publisher(lib: Any, period: float, ports: dict[str, Any], look: Callable[..., None]) -> Any:
    """A system with ports, by name a size or a model value, that looks at their values every period."""

    class Publisher(lib.LeafSystem):
        def __init__(self) -> None:
            super().__init__()
            for name, model in ports.items():
                if isinstance(model, int):
                    self.DeclareVectorInputPort(name, model)
                else:
                    self.DeclareAbstractInputPort(name, model)
            self.DeclarePeriodicPublishEvent(period, 0.0, self._publish)

        def _publish(self, context: Any) -> None:
            look(*[self.get_input_port(i).Eval(context) for i in range(len(ports))])

    return Publisher()


@program("five Python publishers at 200 Hz reading vectors")
def python_publishers(lib: Any) -> Callable[[], Any]:
    def add(builder: Any, plant: Any, scene_graph: Any) -> None:
        for _ in range(5):
            watch = builder.AddSystem(_publisher(lib, 0.005, {"x": 27}, lambda x: x[3]))
            builder.Connect(plant.get_state_output_port(), watch.get_input_port())

    return _with_arm(lib, 1e-3, add)


@program("publisher at 500 Hz of poses, velocities, accelerations")
def python_reads_plant(lib: Any) -> Callable[[], Any]:
    def look(poses: Any, velocities: Any, accelerations: Any) -> None:
        poses[3].translation(), velocities[3].translational(), accelerations[3].translational()

    def add(builder: Any, plant: Any, scene_graph: Any) -> None:
        models = {
            "poses": lib.AbstractValue.Make([lib.RigidTransform()]),
            "velocities": lib.AbstractValue.Make([lib.SpatialVelocity()]),
            "accelerations": lib.AbstractValue.Make([lib.SpatialAcceleration()]),
        }
        watch = builder.AddSystem(_publisher(lib, 0.002, models, look))
        builder.Connect(plant.get_body_poses_output_port(), watch.get_input_port(0))
        builder.Connect(plant.get_body_spatial_velocities_output_port(), watch.get_input_port(1))
        builder.Connect(plant.get_body_spatial_accelerations_output_port(), watch.get_input_port(2))

    return _with_arm(lib, 1e-3, add)


@program("publisher at 500 Hz of contact forces and results")
def python_reads_contact(lib: Any) -> Callable[[], Any]:
    def look(results: Any, forces: Any) -> None:
        for i in range(results.num_point_pair_contacts()):
            info = results.point_pair_contact_info(i)
            info.contact_force(), info.bodyA_index(), abs(info.point_pair().depth)

    def add(builder: Any, plant: Any, scene_graph: Any) -> None:
        models = {"results": lib.AbstractValue.Make(lib.ContactResults()), "forces": 7}
        watch = builder.AddSystem(_publisher(lib, 0.002, models, look))
        arm = plant.GetModelInstanceByName("arm")
        builder.Connect(plant.get_contact_results_output_port(), watch.get_input_port(0))
        builder.Connect(plant.get_generalized_contact_forces_output_port(arm), watch.get_input_port(1))

    return _with_arm(lib, 1e-3, add)


@program("publisher at 500 Hz of net actuation, reactions")
def python_reads_forces(lib: Any) -> Callable[[], Any]:
    def look(actuation: Any, forces: Any) -> None:
        actuation[3], forces[2].translational()

    def add(builder: Any, plant: Any, scene_graph: Any) -> None:
        models = {"actuation": 7, "forces": lib.AbstractValue.Make([lib.SpatialForce()])}
        watch = builder.AddSystem(_publisher(lib, 0.002, models, look))
        builder.Connect(plant.get_net_actuation_output_port(), watch.get_input_port(0))
        builder.Connect(plant.get_reaction_forces_output_port(), watch.get_input_port(1))

    return _with_arm(lib, 1e-3, add)


@program("publisher at 100 Hz with a query object")
def python_reads_query(lib: Any) -> Callable[[], Any]:
    def look(query: Any) -> None:
        for pair in query.ComputePointPairPenetration():
            abs(pair.depth)
        query.HasCollisions()

    def add(builder: Any, plant: Any, scene_graph: Any) -> None:
        models = {"query": lib.AbstractValue.Make(lib.QueryObject())}
        watch = builder.AddSystem(_publisher(lib, 0.01, models, look))
        builder.Connect(scene_graph.get_query_output_port(), watch.get_input_port(0))

    return _with_arm(lib, 1e-3, add)


@program("publisher at 100 Hz with signed distances")
def python_reads_distance(lib: Any) -> Callable[[], Any]:
    def look(query: Any) -> None:
        for pair in query.ComputeSignedDistancePairwiseClosestPoints(0.1):
            abs(pair.distance)

    def add(builder: Any, plant: Any, scene_graph: Any) -> None:
        models = {"query": lib.AbstractValue.Make(lib.QueryObject())}
        watch = builder.AddSystem(_publisher(lib, 0.01, models, look))
        builder.Connect(scene_graph.get_query_output_port(), watch.get_input_port(0))

    return _with_arm(lib, 1e-3, add)


@program("unrestricted updates with abstract state at 200 Hz")
def unrestricted(lib: Any) -> Callable[[], Any]:
    class Machine(lib.LeafSystem):
        def __init__(self) -> None:
            super().__init__()
            self.DeclareVectorInputPort("x", 27)
            self._mode = self.DeclareAbstractState(lib.AbstractValue.Make("wait"))
            self._since = self.DeclareAbstractState(lib.AbstractValue.Make({"t": 0.0}))
            self._held = self.DeclareDiscreteState(7)
            self.DeclarePeriodicUnrestrictedUpdateEvent(0.005, 0.0, self._update)
            self.DeclareVectorOutputPort("y", 7, self._calc)

        def _update(self, context: Any, state: Any) -> None:
            mode = context.get_abstract_state(int(self._mode)).get_value()
            x = self.get_input_port(0).Eval(context)
            if mode == "wait" and context.get_time() > 0.05:
                state.get_mutable_abstract_state(int(self._mode)).set_value("go")
            times = state.get_mutable_abstract_state(int(self._since)).get_mutable_value()
            times["t"] = context.get_time()
            state.get_mutable_discrete_state(self._held).SetFromVector(x[:7])

        def _calc(self, context: Any, output: Any) -> None:
            mode = context.get_abstract_state(int(self._mode)).get_value()
            held = context.get_discrete_state(self._held).value()
            output.SetFromVector(0.1 * held if mode == "go" else np.zeros(7))

    def add(builder: Any, plant: Any, scene_graph: Any) -> None:
        machine = builder.AddSystem(Machine())
        builder.Connect(plant.get_state_output_port(), machine.get_input_port(0))
        builder.Connect(machine.get_output_port(), plant.get_actuation_input_port())

    return _with_arm(lib, 1e-3, add)


@program("Python system with derivatives and three ports")
def python_continuous(lib: Any) -> Callable[[], Any]:
    class Motion(lib.LeafSystem):
        def __init__(self) -> None:
            super().__init__()
            self.DeclareVectorInputPort("u", 1)
            self.DeclareVectorInputPort("d", 1)
            self.DeclareContinuousState(2)
            self.DeclareVectorOutputPort("q", 1, self._q, {self.xc_ticket()})
            self.DeclareVectorOutputPort("v", 1, self._v, {self.xc_ticket()})

        def _q(self, context: Any, output: Any) -> None:
            output.SetAtIndex(0, context.get_continuous_state_vector().GetAtIndex(0))

        def _v(self, context: Any, output: Any) -> None:
            output[0] = context.get_continuous_state_vector()[1]

        def DoCalcTimeDerivatives(self, context: Any, derivatives: Any) -> None:
            x = context.get_continuous_state_vector().CopyToVector()
            u = self.get_input_port(0).Eval(context)
            d = self.get_input_port(1).Eval(context)
            derivatives.get_mutable_vector().SetFromVector([x[1], u[0] + d[0] - np.sin(x[0])])

    builder = lib.DiagramBuilder()
    motion = builder.AddSystem(Motion())
    gain = builder.AddSystem(lib.Gain(np.array([-1.0])))
    damper = builder.AddSystem(lib.Gain(np.array([-0.3])))
    builder.Connect(motion.get_output_port(0), gain.get_input_port())
    builder.Connect(motion.get_output_port(1), damper.get_input_port())
    builder.Connect(gain.get_output_port(), motion.get_input_port(0))
    builder.Connect(damper.get_output_port(), motion.get_input_port(1))

    def prepare(context: Any) -> None:
        motion.GetMyMutableContextFromRoot(context).SetContinuousState([1.0, 0.0])

    return again(lib, builder.Build(), 2.0, prepare)


@program("bouncing ball in Python, with a witness function")
def bouncing_ball(lib: Any) -> Callable[[], Any]:
    class Ball(lib.LeafSystem):
        def __init__(self) -> None:
            super().__init__()
            self.DeclareContinuousState(1, 1, 0)
            falling = lib.WitnessFunctionDirection.kPositiveThenNonPositive
            event = lib.UnrestrictedUpdateEvent(system_callback=Ball._bounce)
            self._witness = self.MakeWitnessFunction("hits the ground", falling, self._height, event)

        def _height(self, context: Any) -> float:
            return context.get_continuous_state_vector()[0]

        def DoGetWitnessFunctions(self, context: Any) -> list:
            return [self._witness]

        def _bounce(self, context: Any, event: Any, state: Any) -> None:
            x = context.get_continuous_state_vector()
            state.get_mutable_continuous_state().get_mutable_vector().SetFromVector([0.0, -0.8 * x[1]])

        def DoCalcTimeDerivatives(self, context: Any, derivatives: Any) -> None:
            x = context.get_continuous_state_vector()
            derivatives.get_mutable_vector().SetFromVector([x[1], -9.81])

    def prepare(context: Any) -> None:
        context.SetContinuousState([1.0, 0.0])
        context.SetAccuracy(1e-4)

    return again(lib, Ball(), 2.0, prepare)


@program("Python VectorSystem")
def python_vector_system(lib: Any) -> Callable[[], Any]:
    class Law(lib.VectorSystem):
        def __init__(self) -> None:
            super().__init__(2, 1, True)

        def DoCalcVectorOutput(self, context: Any, u: Any, x: Any, y: Any) -> None:
            y[:] = -u[0] - u[1]

    builder = lib.DiagramBuilder()
    system = builder.AddSystem(_double_integrator(lib))
    law = builder.AddSystem(Law())
    builder.Connect(system.get_output_port(), law.get_input_port())
    builder.Connect(law.get_output_port(), system.get_input_port())
    return again(lib, builder.Build(), 2.0, lambda c: c.SetContinuousState([1.0, 0.0]))


@program("Python system applying spatial forces at 1 kHz")
def python_forces(lib: Any) -> Callable[[], Any]:
    class Push(lib.LeafSystem):
        def __init__(self, body: Any) -> None:
            super().__init__()
            self._body = body
            self.DeclareAbstractInputPort("poses", lib.AbstractValue.Make([lib.RigidTransform()]))
            self.DeclareAbstractOutputPort(
                "forces", lambda: lib.AbstractValue.Make([lib.ExternallyAppliedSpatialForce()]), self._calc
            )

        def _calc(self, context: Any, output: Any) -> None:
            X = self.get_input_port(0).Eval(context)[int(self._body)]
            force = lib.ExternallyAppliedSpatialForce()
            force.body_index = self._body
            force.p_BoBq_B = np.zeros(3)
            force.F_Bq_W = lib.SpatialForce([0, 0, 0], -X.translation())
            output.set_value([force])

    def add(builder: Any, plant: Any, scene_graph: Any) -> None:
        push = builder.AddSystem(Push(plant.GetBodyByName("one").index()))
        builder.Connect(plant.get_body_poses_output_port(), push.get_input_port())
        builder.Connect(push.get_output_port(), plant.get_applied_spatial_force_input_port())

    return _with_arm(lib, 1e-3, add)


@program("a monitor in Python at every step")
def monitor(lib: Any) -> Callable[[], Any]:
    diagram, plant, _log = _arm_diagram(lib, 1e-3)
    simulator = lib.Simulator(diagram)
    context = simulator.get_mutable_context()
    mine = plant.GetMyContextFromRoot(context)
    low = [0.0]

    def watch(root: Any) -> None:
        low[0] = min(low[0], plant.GetPositions(plant.GetMyContextFromRoot(root))[0])

    simulator.set_monitor(watch)

    def run() -> None:
        context.SetTime(0.0)
        simulator.Initialize()
        simulator.AdvanceTo(0.2)

    run.keep = mine
    return run


def _with_cart_pole(lib: Any, add: Callable[[Any, Any, Any], None], step: float = 0.0) -> Callable[[], Any]:
    builder = lib.DiagramBuilder()
    plant, scene_graph = lib.AddMultibodyPlantSceneGraph(builder, step)
    lib.Parser(plant).AddModelsFromString(robots.cart_pole(), "urdf")
    plant.Finalize()
    add(builder, plant, scene_graph)
    if not builder.IsConnectedOrExported(plant.get_actuation_input_port()):
        source = builder.AddSystem(lib.ConstantVectorSource([0.1]))
        builder.Connect(source.get_output_port(), plant.get_actuation_input_port())
    return again(lib, builder.Build(), 0.5)


def _cart_pole_controller(lib: Any, own: Any = None) -> Any:
    class Controller(lib.LeafSystem):
        def __init__(self) -> None:
            super().__init__()
            self.DeclareVectorInputPort("x", 4)
            self.DeclareVectorOutputPort("u", 1, self._calc)
            self._own = None if own is None else own.CreateDefaultContext()

        def _calc(self, context: Any, output: Any) -> None:
            x = self.get_input_port(0).Eval(context)
            u = x[0] + 50.0 * x[1] + 2.0 * x[2] + 10.0 * x[3]
            if own is not None:
                own.SetPositionsAndVelocities(self._own, x)
                u += (own.CalcMassMatrix(self._own) @ x[2:])[0] - own.CalcGravityGeneralizedForces(self._own)[1]
            output.SetFromVector([u])

    return Controller()


def _cart_pole_with(controls: bool, model: bool, step: float) -> Callable[[Any], Callable[[], Any]]:
    def prepare(lib: Any) -> Callable[[], Any]:
        own = None
        if model:
            own = lib.MultibodyPlant(0.0)
            lib.Parser(own).AddModelsFromString(robots.cart_pole(), "urdf")
            own.Finalize()

        def add(builder: Any, plant: Any, scene_graph: Any) -> None:
            if controls:
                controller = builder.AddSystem(_cart_pole_controller(lib, own))
                builder.Connect(plant.get_state_output_port(), controller.get_input_port())
                builder.Connect(controller.get_output_port(), plant.get_actuation_input_port())
                return
            models = {
                "poses": lib.AbstractValue.Make([lib.RigidTransform()]),
                "velocities": lib.AbstractValue.Make([lib.SpatialVelocity()]),
                "state": 4,
            }
            watch = builder.AddSystem(
                _publisher(lib, 0.001, models, lambda X, V, x: (X[2].translation()[0], V[2].rotational()[1], x[0]))
            )
            builder.Connect(plant.get_body_poses_output_port(), watch.get_input_port(0))
            builder.Connect(plant.get_body_spatial_velocities_output_port(), watch.get_input_port(1))
            builder.Connect(plant.get_state_output_port(), watch.get_input_port(2))

        return _with_cart_pole(lib, add, step)

    return prepare


for _step, _kind in ((0.0, "continuous"), (1e-3, "discrete")):
    PROGRAMS[f"{_kind} cart-pole, a law in Python"] = _cart_pole_with(True, False, _step)
    PROGRAMS[f"{_kind} cart-pole, a law in Python with a model"] = _cart_pole_with(True, True, _step)
    PROGRAMS[f"{_kind} cart-pole, poses and velocities at 1 kHz"] = _cart_pole_with(False, False, _step)


# Pictures, pages and messages.


@program("MeshcatVisualizer at 64 Hz")
def meshcat(lib: Any) -> Callable[[], Any]:
    page = lib.Meshcat()

    def add(builder: Any, plant: Any, scene_graph: Any) -> None:
        lib.MeshcatVisualizer.AddToBuilder(builder, scene_graph, page)

    return _with_arm(lib, 1e-3, add)


@program("MeshcatVisualizer and ContactVisualizer at 64 Hz")
def contact_visualizer(lib: Any) -> Callable[[], Any]:
    page = lib.Meshcat()

    def add(builder: Any, plant: Any, scene_graph: Any) -> None:
        lib.MeshcatVisualizer.AddToBuilder(builder, scene_graph, page)
        lib.ContactVisualizer.AddToBuilder(builder, plant, page)

    return _with_arm(lib, 1e-3, add)


@program("recording with Meshcat")
def recording(lib: Any) -> Callable[[], Any]:
    page = lib.Meshcat()
    kept = []

    def add(builder: Any, plant: Any, scene_graph: Any) -> None:
        kept.append(lib.MeshcatVisualizer.AddToBuilder(builder, scene_graph, page))

    run = _with_arm(lib, 1e-3, add)

    def recorded() -> None:
        kept[0].StartRecording()
        run()
        kept[0].StopRecording()
        kept[0].PublishRecording()

    return recorded


@program("AddDefaultVisualization")
def default_visualization(lib: Any) -> Callable[[], Any]:
    page = lib.Meshcat()

    def add(builder: Any, plant: Any, scene_graph: Any) -> None:
        lib.AddDefaultVisualization(builder, page)

    return _with_arm(lib, 1e-3, add)


def _camera(lib: Any, builder: Any, scene_graph: Any, *colors: Any) -> Any:
    """A camera that looks at the arm: depth, and `colors` (`ColorRenderCamera`) too if given."""
    scene_graph.AddRenderer("r", lib.MakeRenderEngineVtk(lib.RenderEngineVtkParams()))
    info = lib.CameraInfo(320, 240, np.pi / 4)
    core = lib.RenderCameraCore("r", info, lib.ClippingRange(0.01, 10.0), lib.RigidTransform())
    X_WC = lib.RigidTransform(lib.RollPitchYaw(-np.pi / 2, 0, np.pi / 2), [2.0, 0.0, 0.5])
    depth = lib.DepthRenderCamera(core, lib.DepthRange(0.1, 5.0))
    sensor = lib.RgbdSensor(scene_graph.world_frame_id(), X_WC, *[color(core) for color in colors], depth)
    builder.AddSystem(sensor)
    builder.Connect(scene_graph.get_query_output_port(), sensor.query_object_input_port())
    return sensor


@program("camera at 30 Hz, color and depth")
def camera(lib: Any) -> Callable[[], Any]:
    def add(builder: Any, plant: Any, scene_graph: Any) -> None:
        sensor = _camera(lib, builder, scene_graph, lib.ColorRenderCamera)
        models = {
            "color": lib.AbstractValue.Make(lib.ImageRgba8U(320, 240)),
            "depth": lib.AbstractValue.Make(lib.ImageDepth32F(320, 240)),
        }
        watch = builder.AddSystem(
            _publisher(lib, 1 / 30, models, lambda color, depth: (color.data.mean(), depth.data.min()))
        )
        builder.Connect(sensor.color_image_output_port(), watch.get_input_port(0))
        builder.Connect(sensor.depth_image_32F_output_port(), watch.get_input_port(1))

    return _with_arm(lib, 1e-3, add)


@program("camera to point cloud at 10 Hz")
def point_cloud(lib: Any) -> Callable[[], Any]:
    def add(builder: Any, plant: Any, scene_graph: Any) -> None:
        sensor = _camera(lib, builder, scene_graph)
        cloud = builder.AddSystem(lib.DepthImageToPointCloud(sensor.default_depth_render_camera().core().intrinsics()))
        builder.Connect(sensor.depth_image_32F_output_port(), cloud.depth_image_input_port())
        models = {"cloud": lib.AbstractValue.Make(lib.PointCloud())}
        watch = builder.AddSystem(_publisher(lib, 0.1, models, lambda cloud: cloud.size()))
        builder.Connect(cloud.point_cloud_output_port(), watch.get_input_port(0))

    return _with_arm(lib, 1e-3, add)


@program("DrakeVisualizer at 64 Hz over LCM")
def drake_visualizer(lib: Any) -> Callable[[], Any]:
    lcm = lib.DrakeLcm("memq://")

    def add(builder: Any, plant: Any, scene_graph: Any) -> None:
        lib.DrakeVisualizer.AddToBuilder(builder, scene_graph, lcm)

    return _with_arm(lib, 1e-3, add)


@program("inverse dynamics controller with a trajectory")
def inverse_dynamics(lib: Any) -> Callable[[], Any]:
    controlled = lib.MultibodyPlant(1e-3)
    lib.Parser(controlled).AddModelsFromString(robots.arm(False), "urdf")
    controlled.Finalize()

    def add(builder: Any, plant: Any, scene_graph: Any) -> None:
        arm = plant.GetModelInstanceByName("arm")
        controller = builder.AddSystem(
            lib.InverseDynamicsController(controlled, np.full(7, 100.0), np.full(7, 1.0), np.full(7, 20.0), False)
        )
        path = lib.PiecewisePolynomial.FirstOrderHold([0.0, 1.0], np.array([np.zeros(7), np.ones(7)]).T)
        source = builder.AddSystem(lib.TrajectorySource(path, 1))
        builder.Connect(plant.get_state_output_port(arm), controller.get_input_port_estimated_state())
        builder.Connect(source.get_output_port(), controller.get_input_port_desired_state())
        builder.Connect(controller.get_output_port_control(), plant.get_actuation_input_port())

    return _with_arm(lib, 1e-3, add)


@program("station: eight systems in Python")
def station(lib: Any) -> Callable[[], Any]:
    controlled = lib.MultibodyPlant(0.0)
    lib.Parser(controlled).AddModelsFromString(robots.arm(False), "urdf")
    controlled.Finalize()
    own = controlled.CreateDefaultContext()
    frame, world = controlled.GetFrameByName("link7"), controlled.world_frame()

    class Pose(lib.LeafSystem):
        def __init__(self, body: Any) -> None:
            super().__init__()
            self._body = int(body)
            self.DeclareAbstractInputPort("poses", lib.AbstractValue.Make([lib.RigidTransform()]))
            self.DeclareAbstractOutputPort("pose", lambda: lib.AbstractValue.Make(lib.RigidTransform()), self._calc)

        def _calc(self, context: Any, output: Any) -> None:
            output.set_value(self.get_input_port().Eval(context)[self._body])

    class Planner(lib.LeafSystem):
        def __init__(self) -> None:
            super().__init__()
            self.DeclareAbstractInputPort("tool", lib.AbstractValue.Make(lib.RigidTransform()))
            self.DeclareAbstractInputPort("box", lib.AbstractValue.Make(lib.RigidTransform()))
            self._goal = self.DeclareAbstractState(lib.AbstractValue.Make(lib.RigidTransform()))
            self.DeclarePeriodicUnrestrictedUpdateEvent(0.01, 0.0, self._update)
            self.DeclareVectorOutputPort("V", 6, self._calc)

        def _update(self, context: Any, state: Any) -> None:
            box = self.get_input_port(1).Eval(context)
            goal = box @ lib.RigidTransform([0.0, 0.0, 0.2])
            state.get_mutable_abstract_state(int(self._goal)).set_value(goal)

        def _calc(self, context: Any, output: Any) -> None:
            tool = self.get_input_port(0).Eval(context)
            goal = context.get_abstract_state(int(self._goal)).get_value()
            error = goal.translation() - tool.translation()
            output.SetFromVector(np.concatenate([np.zeros(3), 0.5 * error]))

    class DifferentialKinematics(lib.LeafSystem):
        def __init__(self) -> None:
            super().__init__()
            self.DeclareVectorInputPort("q", 7)
            self.DeclareVectorInputPort("V", 6)
            self.DeclareVectorOutputPort("v", 7, self._calc)

        def _calc(self, context: Any, output: Any) -> None:
            controlled.SetPositions(own, self.get_input_port(0).Eval(context))
            J = controlled.CalcJacobianSpatialVelocity(own, lib.JacobianWrtVariable.kV, frame, [0, 0, 0], world, world)
            V = self.get_input_port(1).Eval(context)
            output.SetFromVector(J.T @ np.linalg.solve(J @ J.T + 0.01 * np.eye(6), V))

    class Torque(lib.LeafSystem):
        def __init__(self) -> None:
            super().__init__()
            self.DeclareVectorInputPort("x", 14)
            self.DeclareVectorInputPort("v", 7)
            self.DeclareVectorOutputPort("tau", 7, self._calc)

        def _calc(self, context: Any, output: Any) -> None:
            x, v = self.get_input_port(0).Eval(context), self.get_input_port(1).Eval(context)
            controlled.SetPositions(own, x[:7])
            output.SetFromVector(5.0 * (v - x[7:]) - controlled.CalcGravityGeneralizedForces(own))

    class Positions(lib.LeafSystem):
        def __init__(self) -> None:
            super().__init__()
            self.DeclareVectorInputPort("x", 14)
            self.DeclareVectorOutputPort("q", 7, self._calc)

        def _calc(self, context: Any, output: Any) -> None:
            output.SetFromVector(self.get_input_port().Eval(context)[:7])

    class Limits(lib.LeafSystem):
        def __init__(self) -> None:
            super().__init__()
            self.DeclareVectorInputPort("tau", 7)
            self.DeclareVectorOutputPort("limited", 7, self._calc)
            self._count = self.DeclareDiscreteState(1)
            self.DeclarePeriodicDiscreteUpdateEvent(0.01, 0.0, self._update)

        def _calc(self, context: Any, output: Any) -> None:
            output.SetFromVector(np.clip(self.get_input_port().Eval(context), -100.0, 100.0))

        def _update(self, context: Any, discrete: Any) -> None:
            saturated = np.abs(self.get_input_port().Eval(context)).max() > 100.0
            discrete[0] = context.get_discrete_state(0)[0] + float(saturated)

    def add(builder: Any, plant: Any, scene_graph: Any) -> None:
        arm = plant.GetModelInstanceByName("arm")
        tool = builder.AddSystem(Pose(plant.GetBodyByName("link7").index()))
        box = builder.AddSystem(Pose(plant.GetBodyByName("one").index()))
        planner, kinematics = builder.AddSystem(Planner()), builder.AddSystem(DifferentialKinematics())
        torque, positions, limits = (builder.AddSystem(kind()) for kind in (Torque, Positions, Limits))
        builder.Connect(plant.get_body_poses_output_port(), tool.get_input_port())
        builder.Connect(plant.get_body_poses_output_port(), box.get_input_port())
        builder.Connect(tool.get_output_port(), planner.get_input_port(0))
        builder.Connect(box.get_output_port(), planner.get_input_port(1))
        builder.Connect(plant.get_state_output_port(arm), positions.get_input_port())
        builder.Connect(positions.get_output_port(), kinematics.get_input_port(0))
        builder.Connect(planner.get_output_port(), kinematics.get_input_port(1))
        builder.Connect(plant.get_state_output_port(arm), torque.get_input_port(0))
        builder.Connect(kinematics.get_output_port(), torque.get_input_port(1))
        builder.Connect(torque.get_output_port(), limits.get_input_port())
        builder.Connect(limits.get_output_port(), plant.get_actuation_input_port())
        models = {"tau": 7, "forces": lib.AbstractValue.Make([lib.SpatialForce()])}
        watch = builder.AddSystem(_publisher(lib, 0.01, models, lambda tau, forces: forces[0].translational()))
        builder.Connect(limits.get_output_port(), watch.get_input_port(0))
        builder.Connect(plant.get_reaction_forces_output_port(), watch.get_input_port(1))

    return _with_arm(lib, 1e-3, add)


@program("messages: publish and subscribe at 200 Hz")
def messages(lib: Any) -> Callable[[], Any]:
    import struct

    class Message:
        __slots__ = ("value",)

        def __init__(self) -> None:
            self.value = 0.0

        def encode(self) -> bytes:
            return struct.pack(">q", 77) + struct.pack(">d", self.value)

        @staticmethod
        def decode(data: bytes) -> Message:
            message = Message()
            message.value = struct.unpack(">d", data[8:])[0]
            return message

    class Source(lib.LeafSystem):
        def __init__(self) -> None:
            super().__init__()
            self.DeclareAbstractOutputPort("message", lambda: lib.AbstractValue.Make(Message()), self._calc)

        def _calc(self, context: Any, output: Any) -> None:
            message = Message()
            message.value = context.get_time()
            output.set_value(message)

    lcm = lib.DrakeLcm("memq://")
    builder = lib.DiagramBuilder()
    source = builder.AddSystem(Source())
    publisher = builder.AddSystem(lib.LcmPublisherSystem.Make("LOOP", Message, lcm, 0.005))
    builder.Connect(source.get_output_port(), publisher.get_input_port())
    subscriber = builder.AddSystem(lib.LcmSubscriberSystem.Make("LOOP", Message, lcm))
    models = {"message": lib.AbstractValue.Make(Message())}
    watch = builder.AddSystem(_publisher(lib, 0.005, models, lambda message: message.value))
    builder.Connect(subscriber.get_output_port(), watch.get_input_port())
    builder.AddSystem(lib.LcmInterfaceSystem(lcm=lcm))
    return again(lib, builder.Build(), 1.0)


def measured(run: Callable[[], Any], rounds: int) -> float:
    """CPU time [s] of a call, the best of several rounds."""
    for _ in range(3):
        run()
    begin = time.process_time()
    run()
    once = max(time.process_time() - begin, 1e-7)
    count = max(1, int(SECONDS_A_ROUND / rounds / once))
    best = np.inf
    for _ in range(rounds):
        begin = time.process_time()
        for _ in range(count):
            run()
        best = min(best, (time.process_time() - begin) / count)
    return best


def measure(package: str, titles: list[str], rounds: int) -> None:
    lib = importlib.import_module(f"{package}.all")
    if not hasattr(lib, "ConnectPlanarSceneGraphVisualizer"):
        visualizer = importlib.import_module(f"{package}.systems.planar_scenegraph_visualizer")
        lib.ConnectPlanarSceneGraphVisualizer = visualizer.ConnectPlanarSceneGraphVisualizer
    warnings.simplefilter("ignore")
    for title in titles:
        try:
            print(json.dumps([title, measured(PROGRAMS[title](lib), rounds)]), flush=True)
        except Exception as e:  # one program that fails leaves the others
            print(json.dumps([title, f"{type(e).__name__}: {e}"]), flush=True)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("titles", nargs="*", help="parts of titles")
    parser.add_argument("--rounds", type=int, default=5)
    parser.add_argument("--slower", action="store_true")
    parser.add_argument("--measure", metavar="PACKAGE", help=argparse.SUPPRESS)
    options = parser.parse_args()
    titles = [t for t in PROGRAMS if not options.titles or any(part in t for part in options.titles)]
    if options.measure:
        measure(options.measure, titles, options.rounds)
        return
    found = []
    for package in ("sheldrake", "pydrake"):
        command = [sys.executable, __file__, *titles, "--rounds", str(options.rounds), "--measure", package]
        text = subprocess.run(command, capture_output=True, text=True)
        found.append({t: v for line in text.stdout.splitlines() if line.startswith("[") for t, v in [json.loads(line)]})
        if text.returncode:
            print(f"{package}: {text.stderr[-800:]}")
    print(machine())
    print(f"{'':58s} {'sheldrake':>10s} {'Drake':>10s} {'ratio':>6s}   [us]")
    for title in titles:
        ours, theirs = (one.get(title) for one in found)
        if not isinstance(ours, float) or not isinstance(theirs, float):
            print(f"{title:58s} {ours!s:.80s} | {theirs!s:.80s}")
        elif not options.slower or ours > theirs:
            print(f"{title:58s} {1e6 * ours:10.1f} {1e6 * theirs:10.1f} {ours / theirs:6.2f}")


if __name__ == "__main__":
    main()
