"""CENIC: steps of discrete plants, with error control."""

from __future__ import annotations

import copy

import numpy as np
import pytest

import sheldrake.all as ours
from sheldrake.multibody.cenic import CenicIntegrator
from sheldrake.multibody.contact_solvers import IcfSolverParameters
from sheldrake.systems.framework import PublishEvent, WitnessFunctionDirection

G = 9.81


def material(lib, friction=(0.5, 0.5), stiffness=2e4, dissipation=0.2):
    properties = lib.ProximityProperties()
    lib.AddContactMaterial(dissipation, stiffness, lib.CoulombFriction(*friction), properties)
    return properties


def falling(lib=ours, time_step=0.0, shape=None, slope=0.0, height=0.55, gravity=G, **options):
    """A body above the ground; simulator, plant, its context, the body."""
    builder = lib.DiagramBuilder()
    plant, _ = lib.AddMultibodyPlantSceneGraph(builder, time_step)
    plant.mutable_gravity_field().set_gravity_vector([0.0, 0.0, -gravity])
    body = plant.AddRigidBody("body", lib.SpatialInertia.SolidSphereWithMass(1.0, 0.05))
    shape = lib.Sphere(0.05) if shape is None else shape
    X_WG = lib.RigidTransform(lib.RollPitchYaw(0.0, slope, 0.0), [0.0, 0.0, 0.0])
    plant.RegisterCollisionGeometry(body, lib.RigidTransform(), shape, "shape", material(lib, **options))
    plant.RegisterCollisionGeometry(plant.world_body(), X_WG, lib.HalfSpace(), "ground", material(lib, **options))
    plant.Finalize()
    simulator = lib.Simulator(builder.Build())
    context = plant.GetMyContextFromRoot(simulator.get_context())
    X_WB = X_WG @ lib.RigidTransform([0.0, 0.0, height])
    plant.SetFreeBodyPose(context, body, X_WB)
    return simulator, plant, context, body


def cenic(simulator, lib=ours, max_step=0.1, accuracy=None):
    """Its integrator: with fixed steps unless given an accuracy."""
    integrator = lib.ResetIntegratorFromFlags(simulator, "cenic", max_step)
    if accuracy is None:
        integrator.set_fixed_step_mode(True)
    else:
        integrator.set_target_accuracy(accuracy)
    return integrator


def test_fixed_steps_are_those_of_a_discrete_plant():
    states = []
    for time_step in (1e-3, 0.0):
        simulator, plant, context, body = falling(time_step=time_step, height=0.06)
        plant.SetFreeBodySpatialVelocity(context, body, ours.SpatialVelocity([0.0] * 3, [1.0, 0.5, 0.0]))
        if time_step == 0.0:
            integrator = cenic(simulator, max_step=1e-3)
        simulator.AdvanceTo(0.2)
        states.append(plant.GetPositionsAndVelocities(context))
    assert integrator.get_num_steps_taken() == 200
    for x in states:
        x[:4] /= np.linalg.norm(x[:4])
    np.testing.assert_allclose(states[1], states[0], rtol=0, atol=1e-5)  # a discrete quaternion is not normalized
    np.testing.assert_allclose(states[1][4:7], states[0][4:7], rtol=0, atol=1e-9)


def test_the_error_of_one_step_is_of_second_order():
    """Whole step against two halves: the difference of the positions falls with h²."""
    steps, differences = np.array([1e-3, 5e-4, 2.5e-4]), []
    for h in steps:
        ends = []
        for parts in (1, 2):
            simulator, plant, context, body = falling(height=0.045)
            plant.SetFreeBodySpatialVelocity(context, body, ours.SpatialVelocity([0.0] * 3, [1.0, 0.0, -0.1]))
            cenic(simulator, max_step=h / parts)
            simulator.AdvanceTo(h)
            ends.append(plant.GetPositions(context)[6])
        differences.append(abs(ends[0] - ends[1]))
    assert np.polyfit(np.log(steps), np.log(differences), 1)[0] == pytest.approx(2.0, abs=0.15)


def rebound(accuracy, v):
    """Upward speed of a ball after its impact without gravity, and the number of steps."""
    simulator, plant, context, body = falling(gravity=0.0, height=0.06)
    plant.SetFreeBodySpatialVelocity(context, body, ours.SpatialVelocity([0.0] * 3, [0.0, 0.0, -v]))
    integrator = cenic(simulator, accuracy=accuracy)
    simulator.AdvanceTo(0.06)
    assert plant.GetPositions(context)[6] > 0.05
    return plant.GetVelocities(context)[5], integrator.get_num_steps_taken()


def test_a_bounce_gets_as_exact_as_is_asked():
    """Hunt and Crossley's rebound: v/d - log(1 + d v) / d² is the same before and after.

    The method is of first order, so its error falls with the square root of what a step may err.
    """
    from scipy.optimize import brentq

    d, v = 0.2, 3.0
    level = lambda u: u / d - np.log1p(d * u) / d**2  # noqa: E731
    exact = -brentq(lambda u: level(u) - level(v), -v, 0.0)
    errors, counts = zip(*((abs(speed - exact), n) for speed, n in (rebound(a, v) for a in (1e-4, 1e-5, 1e-6))))
    assert 2.0 < errors[0] / errors[1] < 5.0 and 2.0 < errors[1] / errors[2] < 5.0 and errors[2] < 0.03 * exact
    assert counts[0] < 0.5 * counts[1] < 0.25 * counts[2]


def test_steps_are_long_where_nothing_happens():
    simulator, plant, context, _ = falling(height=0.049, dissipation=20.0)
    integrator = cenic(simulator, accuracy=1e-3)
    simulator.AdvanceTo(5.0)
    assert integrator.get_num_steps_taken() < 120 and integrator.get_largest_step_size_taken() == pytest.approx(0.1)
    assert plant.GetPositions(context)[6] == pytest.approx(0.05 - G / 1e4, abs=1e-6)


@pytest.mark.parametrize(("angle", "slides"), [(np.arctan(0.5), False), (np.arctan(0.8), True)])
def test_static_friction_holds_what_dynamic_friction_would_not(angle, slides):
    simulator, plant, context, _ = falling(
        shape=ours.Box(0.2, 0.1, 0.05),
        slope=angle,
        height=0.025 - G * np.cos(angle) / 4 / 5e5,
        friction=(0.6, 0.3),
        stiffness=1e6,
        dissipation=20.0,
    )
    cenic(simulator, max_step=1e-3)
    simulator.AdvanceTo(0.2)
    v = plant.GetVelocities(context)[3:]
    simulator.AdvanceTo(0.7)
    a = (plant.GetVelocities(context)[3:] - v) @ [np.cos(angle), 0.0, -np.sin(angle)] / 0.5
    expected = G * (np.sin(angle) - 0.3 * np.cos(angle)) if slides else 0.0
    assert a == pytest.approx(expected, abs=8e-3)  # sliding, 0.25 % of the difference of the coefficients are missing


def arm(**options):
    """Two wheels about z, with what a discrete plant may have; simulator, plant, context, joints."""
    builder = ours.DiagramBuilder()
    plant, _ = ours.AddMultibodyPlantSceneGraph(builder, 0.0)
    I = ours.SpatialInertia(1.0, [0, 0, 0], ours.UnitInertia(0.01, 0.01, 0.01))
    joints = []
    for name in ("first", "second"):
        body = plant.AddRigidBody(name, I)
        joint = ours.RevoluteJoint(name, plant.world_frame(), body.body_frame(), [0, 0, 1], *options.get("limits", ()))
        joints.append(plant.AddJoint(joint))
    motor = plant.AddJointActuator("motor", joints[0])
    if "gains" in options:
        motor.set_controller_gains(ours.PdControllerGains(p=options["gains"][0], d=options["gains"][1]))
    if "ratio" in options:
        plant.AddCouplerConstraint(joints[1], joints[0], options["ratio"])
    plant.Finalize()
    simulator = ours.Simulator(builder.Build())
    context = plant.GetMyContextFromRoot(simulator.get_context())
    plant.get_actuation_input_port().FixValue(context, [options.get("torque", 0.0)])
    if "gains" in options:
        plant.get_desired_state_input_port(plant.GetModelInstanceByName("DefaultModelInstance")).FixValue(
            context, [0.3, 0.0]
        )
    cenic(simulator, accuracy=1e-4)
    return simulator, plant, context, joints


def test_joints_keep_to_their_limits():
    simulator, _, context, joints = arm(limits=(-0.2, 0.4), torque=0.05)
    simulator.AdvanceTo(2.0)
    assert joints[0].get_angle(context) == pytest.approx(0.4, abs=1e-3)


def test_couplers_couple():
    simulator, _, context, joints = arm(ratio=-2.0, torque=0.01)
    simulator.AdvanceTo(0.5)
    assert joints[1].get_angle(context) == pytest.approx(-2.0 * joints[0].get_angle(context), abs=1e-5)
    expected = 0.5 * 0.01 / (0.01 + 4.0 * 0.01) * 0.25
    assert joints[0].get_angle(context) == pytest.approx(expected, rel=0.04)


def test_motors_with_gains_go_where_they_are_sent():
    simulator, _, context, joints = arm(gains=(100.0, 5.0))
    simulator.AdvanceTo(2.0)
    assert joints[0].get_angle(context) == pytest.approx(0.3, abs=1e-4)


def controlled(lib=ours, accuracy=1e-3):
    """A wheel of 0.01 kg m² sent to 0.3 rad by a controller that is stiff: 1 / (0.2 ms)."""
    builder = lib.DiagramBuilder()
    plant, _ = lib.AddMultibodyPlantSceneGraph(builder, 0.0)
    body = plant.AddRigidBody("wheel", lib.SpatialInertia(1.0, [0, 0, 0], lib.UnitInertia(0.01, 0.01, 0.01)))
    joint = plant.AddJoint(lib.RevoluteJoint("axle", plant.world_frame(), body.body_frame(), [0, 0, 1]))
    plant.AddJointActuator("motor", joint)
    plant.Finalize()
    control = builder.AddSystem(lib.PidController([1000.0], [0.0], [50.0]))
    builder.Connect(plant.get_state_output_port(), control.get_input_port_estimated_state())
    goal = builder.AddSystem(lib.ConstantVectorSource([0.3, 0.0]))
    builder.Connect(goal.get_output_port(), control.get_input_port_desired_state())
    builder.Connect(control.get_output_port(), plant.get_actuation_input_port())
    simulator = lib.Simulator(builder.Build())
    integrator = cenic(simulator, lib, accuracy=accuracy)
    simulator.AdvanceTo(1.0)
    context = plant.GetMyContextFromRoot(simulator.get_context())
    return joint.get_angle(context), integrator.get_num_steps_taken()


def test_stiff_controllers_need_no_short_steps():
    angle, steps = controlled()
    assert angle == pytest.approx(0.3, abs=1e-3) and steps < 60
    slow, many = controlled(accuracy=1e-6)
    assert slow == pytest.approx(0.3, abs=1e-6) and many < 2000


@pytest.mark.peer
def test_a_controlled_wheel_goes_where_drakes_goes():
    """Drake takes fewer steps: it keeps its linearization for the halves, whose difference does not see its error."""
    drake = pytest.importorskip("pydrake.all")
    (angle, steps), (angle2, steps2) = controlled(), controlled(drake)
    assert angle == pytest.approx(angle2, abs=1e-5) and steps2 <= steps < 3 * steps2


def test_other_systems_go_along():
    """A controller with a state of its own: the integral of the speed is the angle."""
    builder = ours.DiagramBuilder()
    plant, _ = ours.AddMultibodyPlantSceneGraph(builder, 0.0)
    body = plant.AddRigidBody("wheel", ours.SpatialInertia.SolidSphereWithMass(1.0, 0.1))
    plant.AddJoint(ours.RevoluteJoint("axle", plant.world_frame(), body.body_frame(), [0, 0, 1]))
    plant.Finalize()
    integral = builder.AddSystem(ours.Integrator(2))
    builder.Connect(plant.get_state_output_port(), integral.get_input_port())
    diagram = builder.Build()
    simulator = ours.Simulator(diagram)
    context = plant.GetMyContextFromRoot(simulator.get_context())
    plant.SetPositionsAndVelocities(context, [0.5, 2.0])
    cenic(simulator, accuracy=1e-5)
    simulator.AdvanceTo(1.0)
    found = integral.GetMyContextFromRoot(simulator.get_context()).get_continuous_state_vector().CopyToVector()
    np.testing.assert_allclose(plant.GetPositionsAndVelocities(context), [2.5, 2.0], rtol=1e-12)
    assert found[1] == pytest.approx(2.0, rel=1e-12) and found[0] == pytest.approx(1.5, abs=0.06)


class Breeze(ours.LeafSystem):
    """Pushes a body against its velocity, as the wind does."""

    def __init__(self, plant, body, drag):
        ours.LeafSystem.__init__(self)
        self.body, self.drag = body, drag
        self.state = self.DeclareVectorInputPort("state", plant.num_multibody_states())
        alloc = ours.Value[list[ours.ExternallyAppliedSpatialForce]]
        self.DeclareAbstractOutputPort("force", alloc, self.blow)

    def blow(self, context, output):
        force = ours.ExternallyAppliedSpatialForce()
        force.body_index = self.body.index()
        force.F_Bq_W = ours.SpatialForce([0.0] * 3, -self.drag * self.state.Eval(context)[-3:])
        output.set_value([force])


@pytest.mark.parametrize("native", [True, False])
def test_spatial_forces_of_other_systems_are_implicit(native):
    """A drag with a time constant of 1 ms, steps of 20 ms: by implicit Euler v falls to 1 / 21 in each."""
    builder = ours.DiagramBuilder()
    plant, _ = ours.AddMultibodyPlantSceneGraph(builder, 0.0)
    plant.mutable_gravity_field().set_gravity_vector([0.0, 0.0, 0.0])
    body = plant.AddRigidBody("body", ours.SpatialInertia.SolidSphereWithMass(1.0, 0.05))
    plant.Finalize()
    breeze = builder.AddSystem(Breeze(plant, body, 1000.0))
    builder.Connect(plant.get_state_output_port(), breeze.state)
    builder.Connect(breeze.get_output_port(), plant.get_applied_spatial_force_input_port())
    simulator = ours.Simulator(builder.Build())
    simulator._native = native
    context = plant.GetMyContextFromRoot(simulator.get_context())
    plant.SetVelocities(context, [0.0, 0.0, 0.0, 1.0, -2.0, 0.0])
    cenic(simulator, max_step=0.02)
    simulator.AdvanceTo(0.04)
    np.testing.assert_allclose(
        plant.GetVelocities(context), np.array([0, 0, 0, 1.0, -2.0, 0]) / 21**2, rtol=1e-4, atol=1e-12
    )


def test_the_loop_in_python_makes_the_same_steps():
    found = []
    for native in (True, False):
        simulator, plant, context, body = falling(height=0.0505)
        plant.SetFreeBodySpatialVelocity(context, body, ours.SpatialVelocity([0.0] * 3, [1.0, 0.5, 0.0]))
        simulator._native = native
        integrator = cenic(simulator, accuracy=1e-6)
        simulator.AdvanceTo(0.02)
        found.append((plant.GetPositionsAndVelocities(context), integrator.get_num_steps_taken()))
    assert found[0][1] == found[1][1] > 5
    np.testing.assert_allclose(found[0][0], found[1][0], rtol=0, atol=1e-12)


class Line(ours.LeafSystem):
    """Ends the simulation when a body falls through a height."""

    def __init__(self, plant, height):
        ours.LeafSystem.__init__(self)
        self.state = self.DeclareVectorInputPort("state", plant.num_multibody_states())
        event = PublishEvent(
            system_callback=lambda system, context, event: ours.EventStatus.ReachedTermination(self, "there")
        )
        self.witness = self.MakeWitnessFunction(
            "line", WitnessFunctionDirection.kPositiveThenNonPositive, lambda c: self.state.Eval(c)[6] - height, event
        )

    def DoGetWitnessFunctions(self, context):
        return [self.witness]


def test_witness_functions_find_their_moment():
    """Steps of which only a part is wanted are made from Python."""
    builder = ours.DiagramBuilder()
    plant, _ = ours.AddMultibodyPlantSceneGraph(builder, 0.0)
    plant.AddRigidBody("body", ours.SpatialInertia.SolidSphereWithMass(1.0, 0.05))
    plant.Finalize()
    line = builder.AddSystem(Line(plant, -1.0))
    builder.Connect(plant.get_state_output_port(), line.state)
    simulator = ours.Simulator(builder.Build())
    cenic(simulator, accuracy=1e-6)
    simulator.AdvanceTo(1.0)
    assert simulator.get_context().get_time() == pytest.approx(np.sqrt(2.0 / G), abs=1e-3)


def test_settings_may_change_between_advances():
    """Accuracy, fixed steps and the solver's limits are those of the moment."""
    simulator, plant, context, body = falling(height=0.0505)
    start = plant.GetPositionsAndVelocities(context)
    integrator = cenic(simulator, accuracy=1e-2)
    simulator.AdvanceTo(0.1)
    few = integrator.get_num_steps_taken()
    integrator.set_target_accuracy(1e-6)
    plant.SetPositionsAndVelocities(context, start)
    simulator.AdvanceTo(0.2)
    many = integrator.get_num_steps_taken() - few
    assert many > 3 * few
    integrator.set_maximum_step_size(0.01)
    integrator.set_fixed_step_mode(True)
    simulator.AdvanceTo(0.3)
    assert integrator.get_num_steps_taken() - few - many == 10
    into_the_ground = ours.SpatialVelocity([9.0] * 3, [5.0, 5.0, -5.0])
    plant.SetFreeBodySpatialVelocity(context, body, into_the_ground)
    integrator.SetSolverParameters(IcfSolverParameters(max_iterations=0))
    with pytest.raises(RuntimeError, match="has not converged"):
        simulator.AdvanceTo(0.4)


def test_what_it_is_given_is_checked():
    with pytest.raises(RuntimeError, match="must be given a Diagram, not a MultibodyPlant"):
        CenicIntegrator(ours.MultibodyPlant(0.0))
    simulator, *_ = falling(time_step=1e-3)
    with pytest.raises(RuntimeError, match=r"continuous time plant.*time_step = 0.001"):
        CenicIntegrator(simulator.get_system())
    builder = ours.DiagramBuilder()
    builder.AddNamedSystem("gain", ours.Gain(1.0, 1))
    with pytest.raises(RuntimeError, match="does not have a subsystem named plant"):
        CenicIntegrator(builder.Build())
    simulator, *_ = falling()
    integrator = CenicIntegrator(simulator.get_system(), simulator.get_mutable_context())
    with pytest.raises(RuntimeError, match="maximum step size"):
        integrator.Initialize()
    with pytest.raises(TypeError, match="IcfSolverParameters"):
        integrator.SetSolverParameters(3)


def test_settings_of_the_solver():
    parameters = IcfSolverParameters(max_iterations=7)
    assert (parameters.max_iterations, parameters.min_tolerance, parameters.alpha_max) == (7, 1e-8, 1.0)
    assert copy.deepcopy(parameters).max_iterations == 7 and "max_iterations=7" in repr(parameters)
    assert {f.name for f in IcfSolverParameters.__fields__} == set(vars(parameters))
    with pytest.raises(AttributeError, match="has no attribute 'iterations'"):
        IcfSolverParameters(iterations=1)
    simulator, plant, context, body = falling(height=0.0499, shape=ours.Box(0.1, 0.1, 0.1), stiffness=1e8)
    plant.SetFreeBodySpatialVelocity(context, body, ours.SpatialVelocity([3.0, 2.0, 1.0], [2.0, 1.0, -5.0]))
    integrator = cenic(simulator, accuracy=1e-6)
    integrator.SetSolverParameters(IcfSolverParameters(max_iterations=1))
    assert integrator.get_solver_parameters().max_iterations == 1
    with pytest.raises(RuntimeError, match="has not converged"):
        simulator.AdvanceTo(0.1)


@pytest.mark.peer
@pytest.mark.parametrize("accuracy", [1e-2, 1e-3, 1e-4])
def test_as_many_steps_as_drake_and_the_same_motion(accuracy):
    drake = pytest.importorskip("pydrake.all")
    found = []
    for lib in (ours, drake):
        simulator, plant, context, body = falling(lib)
        plant.SetFreeBodySpatialVelocity(context, body, lib.SpatialVelocity([0.0] * 3, [1.0, 0.0, 0.0]))
        integrator = cenic(simulator, lib, accuracy=accuracy)
        simulator.AdvanceTo(0.6)
        counts = integrator.get_num_steps_taken(), integrator.get_num_step_shrinkages_from_error_control()
        found.append((counts, plant.GetPositionsAndVelocities(context)))
    assert found[0][0] == found[1][0]
    np.testing.assert_allclose(found[0][1], found[1][1], rtol=0, atol=0.1 * accuracy + 1e-5)
