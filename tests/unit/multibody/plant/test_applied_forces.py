"""Forces from outside on bodies: the step and the derivatives stay machine code, whatever feeds them."""

from __future__ import annotations

import numpy as np
import pytest

from sheldrake.all import (
    AbstractValue,
    AddMultibodyPlantSceneGraph,
    AutoDiffXd,
    BodyIndex,
    Box,
    ConstantVectorSource,
    CoulombFriction,
    DiagramBuilder,
    ExternallyAppliedSpatialForce,
    ExternallyAppliedSpatialForceMultiplexer,
    FixedOffsetFrame,
    HalfSpace,
    JacobianWrtVariable,
    LeafSystem,
    MultibodyPlant,
    PiecewisePolynomial,
    PrismaticJoint,
    Propeller,
    PropellerInfo,
    RevoluteJoint,
    RigidTransform,
    RollPitchYaw,
    Simulator,
    SpatialForce,
    SpatialInertia,
    TrajectorySource,
    Wing,
)
from sheldrake.common._native import binding
from sheldrake.common.kernel import Kernel
from sheldrake.systems.framework._declarations import PythonStage

POINT, FORCE = np.array([0.1, -0.2, 0.05]), np.array([0.3, -0.1, 0.2, 2.0, 1.0, -3.0])


class Pushes(LeafSystem):
    """A force on each of some bodies, at a point that is not the origin, growing with time."""

    def __init__(self, bodies):
        super().__init__()
        self.bodies = bodies
        self.DeclareAbstractOutputPort(
            "forces", lambda: AbstractValue.Make([ExternallyAppliedSpatialForce()]), self._calc
        )

    def _calc(self, context, output):
        forces = []
        for k, body in enumerate(self.bodies):
            force = ExternallyAppliedSpatialForce()
            force.body_index, force.p_BoBq_B = body, POINT * (k + 1)
            force.F_Bq_W = SpatialForce(FORCE * (1.0 + context.get_time()))
            forces.append(force)
        output.set_value(forces)


def next_state(system: object, context: object) -> np.ndarray:
    return system.EvalUniquePeriodicDiscreteUpdate(context).get_vector(0).CopyToVector()


def two_links(time_step: float) -> tuple[DiagramBuilder, MultibodyPlant]:
    builder = DiagramBuilder()
    plant, _ = AddMultibodyPlantSceneGraph(builder, time_step)
    inertia = SpatialInertia.SolidBoxWithMass(1.5, 0.3, 0.4, 0.5).Shift([-0.1, 0.0, -0.2])
    free, hinged = plant.AddRigidBody("free", inertia), plant.AddRigidBody("hinged", inertia)
    frame = plant.AddFrame(FixedOffsetFrame("at", free.body_frame(), RigidTransform([0.2, 0.1, 0.0])))
    plant.AddJoint(RevoluteJoint("joint", frame, hinged.body_frame(), [0.0, 0.6, 0.8]))
    friction = CoulombFriction(0.5, 0.5)
    plant.RegisterCollisionGeometry(plant.world_body(), RigidTransform([0, 0, -5]), HalfSpace(), "ground", friction)
    plant.RegisterCollisionGeometry(free, RigidTransform(), Box(0.1, 0.1, 0.1), "box", friction)
    if time_step:
        plant.SetUseSampledOutputPorts(False)
    plant.Finalize()
    return builder, plant


def start(plant: MultibodyPlant, context: object) -> None:
    plant.SetFreeBodyPose(context, plant.GetBodyByName("free"), RigidTransform(RollPitchYaw(0.3, -0.2, 1.0), [1, 2, 3]))
    plant.SetVelocities(context, np.linspace(-1.0, 1.0, plant.num_velocities()))


def fed(time_step: float) -> tuple[object, MultibodyPlant, object]:
    builder, plant = two_links(time_step)
    pushes = builder.AddSystem(Pushes([plant.GetBodyByName(name).index() for name in ("free", "hinged", "free")]))
    builder.Connect(pushes.get_output_port(), plant.get_applied_spatial_force_input_port())
    diagram = builder.Build()
    context = diagram.CreateDefaultContext()
    start(plant, plant.GetMyContextFromRoot(context))
    return diagram, plant, context


@pytest.mark.parametrize("time_step", [0.0, 0.01])
def test_forces_at_points_do_what_their_generalized_forces_do(time_step):
    diagram, plant, context = fed(time_step)
    own = plant.GetMyContextFromRoot(context)
    W, tau = plant.world_frame(), np.zeros(plant.num_velocities())
    for k, name in enumerate(("free", "hinged", "free")):
        frame = plant.GetFrameByName(name)
        J = plant.CalcJacobianSpatialVelocity(own, JacobianWrtVariable.kV, frame, POINT * (k + 1), W, W)
        tau += J.T @ FORCE
    other_builder, other = two_links(time_step)
    whole = other_builder.Build()
    other_context = whole.CreateDefaultContext()
    start(other, other.GetMyContextFromRoot(other_context))
    other.get_applied_generalized_force_input_port().FixValue(other.GetMyContextFromRoot(other_context), tau)
    if time_step:
        found = next_state(diagram, context)
        expected = next_state(whole, other_context)
    else:
        found = diagram.EvalTimeDerivatives(context).CopyToVector()
        expected = whole.EvalTimeDerivatives(other_context).CopyToVector()
    np.testing.assert_allclose(found, expected, rtol=1e-12, atol=1e-12)  # round-off of sums in another order


@pytest.mark.parametrize("time_step", [0.0, 0.01])
def test_only_the_list_is_read_in_python(time_step):
    _, plant, context = fed(time_step)
    layout = context._store.layout
    n = layout.node_of[plant._system_id]
    place = layout.places[n]
    handlers = [place.derivatives] if not time_step else [r for r in place.events if r >= 0]
    assert handlers
    for first in handlers:
        reads, *rest = [layout.rows[r].calc for r in layout.stages(first)]
        assert isinstance(reads, PythonStage)
        assert rest
        assert all(isinstance(calc, Kernel) for calc in rest)


@pytest.mark.parametrize("time_step", [0.0, 0.01])
def test_no_argument_is_packed_twice(time_step, monkeypatch):
    """After the first steps, nothing writes the words of a kernel's arguments any more, and no memory moves."""
    diagram, _, context = fed(time_step)
    simulator = Simulator(diagram, context)
    simulator.AdvanceTo(0.05)
    packed = []
    write = binding._Writer.write
    monkeypatch.setattr(binding._Writer, "write", lambda *args, **kwargs: packed.append(args) or write(*args, **kwargs))
    for t in np.linspace(0.06, 0.2, 8):
        simulator.AdvanceTo(t)
    assert not packed


def test_forces_may_come_and_go():
    diagram, _, context = fed(0.01)
    pushes = diagram.GetSystems()[-1]
    pushes.bodies = pushes.bodies * 20  # more than there was room for
    many = next_state(diagram, context)
    context.SetTime(0.0)
    pushes.bodies = []
    none = next_state(diagram, context)
    plain_builder, plain = two_links(0.01)
    whole = plain_builder.Build()
    plain_context = whole.CreateDefaultContext()
    start(plain, plain.GetMyContextFromRoot(plain_context))
    expected = next_state(whole, plain_context)
    np.testing.assert_array_equal(none, expected)
    assert np.abs(many - none).max() > 0.1


def test_a_force_on_a_body_that_is_not_there_is_refused():
    diagram, _, context = fed(0.01)
    diagram.GetSystems()[-1].bodies = [BodyIndex(7)]
    with pytest.raises(RuntimeError, match="applied_spatial_force"):
        Simulator(diagram, context).AdvanceTo(0.02)


def test_propellers_and_wings_of_odd_numbers_are_refused_by_name():
    with pytest.raises(TypeError, match="thrust_ratio must be float, not str"):
        Propeller(BodyIndex(1), RigidTransform(), "x")
    with pytest.raises(TypeError, match="body_index must be BodyIndex, not None"):
        Propeller(None)
    with pytest.raises(TypeError, match="surface_area must be float, not str"):
        Wing(BodyIndex(1), "x")


class JoinedInPython(ExternallyAppliedSpatialForceMultiplexer):
    """A multiplexer that joins lists in Python, whatever feeds it."""

    def _native_forces(self, plant, rows_of, root):
        return None


def hovering(time_step: float, as_list: bool) -> tuple[object, MultibodyPlant]:
    """Two links with propellers, whose forces come as a list or, straight from the propellers, by a kernel."""
    builder, plant = two_links(time_step)
    bodies = [plant.GetBodyByName(name).index() for name in ("free", "hinged")]
    X = RigidTransform(RollPitchYaw(0.1, 0.2, 0.3), POINT)
    propellers = builder.AddSystem(Propeller([PropellerInfo(body, X, 2.0, 0.3) for body in bodies]))
    forces = propellers.get_output_port()
    if as_list:
        joined = builder.AddSystem(JoinedInPython(1))
        builder.Connect(forces, joined.get_input_port(0))
        forces = joined.get_output_port()
    builder.Connect(forces, plant.get_applied_spatial_force_input_port())
    builder.Connect(plant.get_body_poses_output_port(), propellers.get_body_poses_input_port())
    builder.ExportInput(propellers.get_command_input_port(), "u")
    return builder.Build(), plant


@pytest.mark.parametrize("time_step", [0.0, 0.01])
def test_propellers_are_a_stage_of_the_plant_that_they_lift(time_step):
    found = {}
    for as_list in (True, False):
        diagram, plant = hovering(time_step, as_list)
        context = diagram.CreateDefaultContext()
        own = plant.GetMyContextFromRoot(context)
        start(plant, own)
        diagram.get_input_port().FixValue(context, [3.0, -2.0])
        assert kinds_of_stages(plant, context) == ({PythonStage, Kernel} if as_list else {Kernel})
        motion = next_state(diagram, context) if time_step else diagram.EvalTimeDerivatives(context).CopyToVector()
        simulator = Simulator(diagram, context)
        simulator.AdvanceTo(0.1)
        found[as_list] = np.concatenate([motion, plant.GetPositionsAndVelocities(own)])
    np.testing.assert_allclose(found[False], found[True], rtol=1e-11, atol=1e-11)  # round-off over ten steps


@pytest.mark.parametrize("time_step", [0.0, 0.01])
@pytest.mark.parametrize("as_list", [True, False])
def test_propellers_need_a_command(time_step, as_list):
    diagram, _ = hovering(time_step, as_list)
    with pytest.raises(RuntimeError, match="not connected"):
        Simulator(diagram).AdvanceTo(0.05)


@pytest.mark.parametrize("time_step", [0.0, 0.01])
@pytest.mark.parametrize("as_list", [True, False])
def test_derivatives_through_applied_forces(time_step, as_list):
    """Derivatives by state and command, against central differences."""
    diagram, plant = hovering(time_step, as_list)
    context = diagram.CreateDefaultContext()
    start(plant, plant.GetMyContextFromRoot(context))
    plant_context = plant.GetMyContextFromRoot(context)
    z = np.concatenate([plant.GetPositionsAndVelocities(plant_context), [3.0, -2.0]])

    def motion(system, own, values):
        inner = system.GetSubsystemByName("plant")
        inner.SetPositionsAndVelocities(inner.GetMyMutableContextFromRoot(own), values[:-2])
        system.get_input_port().FixValue(own, values[-2:])
        if time_step:
            return next_state(system, own)
        return system.EvalTimeDerivatives(own).CopyToVector()

    on_duals = diagram.ToAutoDiffXd()
    duals = np.array([AutoDiffXd(value, row) for value, row in zip(z, np.eye(len(z)))])
    own = on_duals.CreateDefaultContext()
    start_duals = motion(on_duals, own, duals)
    again = [motion(on_duals, own, duals) for _ in range(3)][-1]
    slopes = np.array([a.derivatives() for a in start_duals])
    np.testing.assert_array_equal(slopes, np.array([a.derivatives() for a in again]))
    h = 1e-6
    for k in range(len(z)):
        step = h * (np.arange(len(z)) == k)
        expected = (motion(diagram, context, z + step) - motion(diagram, context, z - step)) / (2 * h)
        np.testing.assert_allclose(slopes[:, k], expected, rtol=1e-6, atol=2e-6)  # h² and round-off / h


def gliding(time_step: float, joined_by: type, density: float | None = None) -> tuple[object, MultibodyPlant]:
    """Two links with a propeller and two wings, one of them in wind, joined in Python or by kernels."""
    builder, plant = two_links(time_step)
    bodies = [plant.GetBodyByName(name).index() for name in ("free", "hinged")]
    X = RigidTransform(RollPitchYaw(0.1, 0.2, 0.3), POINT)
    systems = [builder.AddSystem(Propeller(bodies[1], X, 2.0, 0.3))]
    systems += [builder.AddSystem(Wing(body, 0.5, X)) for body in bodies]
    for wing in systems[1:]:
        builder.Connect(plant.get_body_spatial_velocities_output_port(), wing.get_body_spatial_velocities_input_port())
    command = builder.AddSystem(ConstantVectorSource([3.0]))
    builder.Connect(command.get_output_port(), systems[0].get_command_input_port())
    wind = builder.AddSystem(ConstantVectorSource([1.0, -2.0, 0.5]))
    builder.Connect(wind.get_output_port(), systems[1].get_wind_velocity_input_port())
    if density is not None:
        air = builder.AddSystem(ConstantVectorSource([density]))
        builder.Connect(air.get_output_port(), systems[2].get_fluid_density_input_port())
    joined = builder.AddSystem(joined_by(3))
    for i, system in enumerate(systems):
        builder.Connect(plant.get_body_poses_output_port(), system.get_body_poses_input_port())
        builder.Connect(system.get_output_port(0), joined.get_input_port(i))
    builder.Connect(joined.get_output_port(), plant.get_applied_spatial_force_input_port())
    return builder.Build(), plant


def kinds_of_stages(plant: MultibodyPlant, context: object) -> set[type]:
    layout = context._store.layout
    n = layout.node_of[plant._system_id]
    first = layout.places[n].events[0] if plant.is_discrete() else layout.places[n].derivatives
    return {type(layout.rows[r].calc) for r in layout.stages(first)}


@pytest.mark.parametrize("density", [None, 3.0, 0.0])
@pytest.mark.parametrize("time_step", [0.0, 0.01])
def test_what_a_multiplexer_joins_are_stages_of_the_plant(time_step, density):
    found = []
    for joined_by, kinds in (
        (ExternallyAppliedSpatialForceMultiplexer, {Kernel}),
        (JoinedInPython, {PythonStage, Kernel}),
    ):
        diagram, plant = gliding(time_step, joined_by, density)
        context = diagram.CreateDefaultContext()
        own = plant.GetMyContextFromRoot(context)
        start(plant, own)
        assert kinds_of_stages(plant, context) == kinds
        motion = next_state(diagram, context) if time_step else diagram.EvalTimeDerivatives(context).CopyToVector()
        Simulator(diagram, context).AdvanceTo(0.1)
        found.append(np.concatenate([motion, plant.GetPositionsAndVelocities(own)]))
    np.testing.assert_allclose(*found, rtol=1e-11, atol=1e-11)  # round-off over ten steps


def test_a_wing_has_the_density_that_is_fixed_and_else_its_own():
    builder, plant = two_links(0.0)
    wing = Wing.AddToBuilder(builder, plant, plant.GetBodyByName("free").index(), 0.5)
    diagram = builder.Build()
    motions = []
    for density in (None, 1.204, 2.408):
        context = diagram.CreateDefaultContext()
        start(plant, plant.GetMyContextFromRoot(context))
        if density is not None:
            wing.get_fluid_density_input_port().FixValue(wing.GetMyContextFromRoot(context), [density])
        motions.append(diagram.EvalTimeDerivatives(context).CopyToVector())
    np.testing.assert_array_equal(motions[0], motions[1])
    assert np.abs(motions[2] - motions[0]).max() > 0.1


def test_wings_with_densities_of_their_own_may_share_a_port_of_the_diagram():
    motions = []
    for exported in (False, True):
        builder, plant = two_links(0.0)
        joined = builder.AddSystem(ExternallyAppliedSpatialForceMultiplexer(2))
        for i, name in enumerate(("free", "hinged")):
            wing = builder.AddSystem(Wing(plant.GetBodyByName(name).index(), 0.5, fluid_density=1.0 + i))
            velocities = plant.get_body_spatial_velocities_output_port()
            builder.Connect(plant.get_body_poses_output_port(), wing.get_body_poses_input_port())
            builder.Connect(velocities, wing.get_body_spatial_velocities_input_port())
            builder.Connect(wing.get_spatial_force_output_port(), joined.get_input_port(i))
            if exported and i == 0:
                builder.ExportInput(wing.get_fluid_density_input_port(), "density")
            elif exported:
                builder.ConnectInput("density", wing.get_fluid_density_input_port())
        builder.Connect(joined.get_output_port(), plant.get_applied_spatial_force_input_port())
        diagram = builder.Build()
        context = diagram.CreateDefaultContext()
        start(plant, plant.GetMyContextFromRoot(context))
        motions.append(diagram.EvalTimeDerivatives(context).CopyToVector())
    np.testing.assert_allclose(*motions, rtol=1e-12, atol=1e-12)  # round-off of sums in another order


@pytest.mark.parametrize("time_step", [0.0, 0.01])
def test_derivatives_through_wings(time_step):
    """Slopes by kernels are those of the lists in Python."""
    slopes = []
    for joined_by in (ExternallyAppliedSpatialForceMultiplexer, JoinedInPython):
        diagram, plant = gliding(time_step, joined_by)
        context = diagram.CreateDefaultContext()
        start(plant, plant.GetMyContextFromRoot(context))
        x = plant.GetPositionsAndVelocities(plant.GetMyContextFromRoot(context))
        on_duals = diagram.ToAutoDiffXd()
        own = on_duals.CreateDefaultContext()
        inner = on_duals.GetSubsystemByName("plant")
        duals = np.array([AutoDiffXd(value, row) for value, row in zip(x, np.eye(len(x)))])
        inner.SetPositionsAndVelocities(inner.GetMyMutableContextFromRoot(own), duals)
        motion = next_state(on_duals, own) if time_step else on_duals.EvalTimeDerivatives(own).CopyToVector()
        slopes.append(np.array([a.derivatives() for a in motion]))
    np.testing.assert_allclose(*slopes, rtol=1e-9, atol=1e-9)  # round-off of other sums


def pushed_on_a_rail(by_propeller: bool, sampled: bool, dt: float = 0.01) -> tuple[object, MultibodyPlant, object]:
    """A block that a joint holds against a force of 100 t along x [N], without gravity."""
    builder = DiagramBuilder()
    plant = builder.AddSystem(MultibodyPlant(dt))
    block = plant.AddRigidBody("block", SpatialInertia.SolidBoxWithMass(1.0, 0.1, 0.1, 0.1))
    plant.AddJoint(PrismaticJoint("rail", plant.world_frame(), block.body_frame(), [0, 0, 1]))
    plant.mutable_gravity_field().set_gravity_vector([0, 0, 0])
    plant.SetUseSampledOutputPorts(sampled)
    plant.Finalize()
    ramp = builder.AddSystem(TrajectorySource(PiecewisePolynomial.FirstOrderHold([0.0, 1.0], [[0.0, 100.0]])))
    x_for_z = RigidTransform(RollPitchYaw(0.0, np.pi / 2, 0.0), [0, 0, 0])
    propeller = builder.AddSystem(Propeller([PropellerInfo(block.index(), x_for_z, 1.0, 0.0)]))
    builder.Connect(plant.get_body_poses_output_port(), propeller.get_body_poses_input_port())
    builder.Connect(ramp.get_output_port(), propeller.get_command_input_port())
    forces = propeller.get_output_port()
    if not by_propeller:
        joined = builder.AddSystem(JoinedInPython(1))
        builder.Connect(forces, joined.get_input_port(0))
        forces = joined.get_output_port()
    builder.Connect(forces, plant.get_applied_spatial_force_input_port())
    diagram = builder.Build()
    return diagram, plant, Simulator(diagram)


@pytest.mark.parametrize("sampled", [True, False])
@pytest.mark.parametrize("by_propeller", [True, False])
def test_reactions_are_of_the_forces_of_their_step(by_propeller, sampled):
    """A sampled port speaks of the last step, which began with the force of its time; as in Drake."""
    _, plant, simulator = pushed_on_a_rail(by_propeller, sampled)
    for t, last in ((0.005, 0.0), (0.015, 0.01), (0.038, 0.03)):
        simulator.AdvanceTo(t)
        for root in (simulator.get_context(), simulator.get_context().Clone()):
            (reaction,) = plant.get_reaction_forces_output_port().Eval(plant.GetMyContextFromRoot(root))
            expected = [-100.0 * (last if sampled else t), 0.0, 0.0]
            np.testing.assert_allclose(reaction.translational(), expected, rtol=1e-12, atol=1e-12)


def test_forces_may_be_fixed_after_some_steps():
    """What steps have left is kept when the scratch grows by forces on bodies."""
    plant = MultibodyPlant(0.01)
    body = plant.AddRigidBody("body", SpatialInertia.SolidBoxWithMass(2.0, 0.1, 0.1, 0.1))
    plant.AddJoint(PrismaticJoint("rail", plant.world_frame(), body.body_frame(), [0, 0, 1]))
    plant.Finalize()
    simulator = Simulator(plant)
    context = simulator.get_mutable_context()
    simulator.AdvanceTo(0.1)
    push = ExternallyAppliedSpatialForce()
    push.body_index, push.F_Bq_W = body.index(), SpatialForce([0, 0, 0], [5.0, 0, 1.0])
    acceleration = plant.get_generalized_acceleration_output_port()
    plant.get_applied_spatial_force_input_port().FixValue(context, AbstractValue.Make([push]))
    np.testing.assert_allclose(acceleration.Eval(context), [-9.81], rtol=1e-12)
    simulator.AdvanceTo(0.2)
    (reaction,) = plant.get_reaction_forces_output_port().Eval(context)
    np.testing.assert_allclose(reaction.translational(), [-5.0, 0.0, 0.0], atol=1e-12)
    np.testing.assert_allclose(acceleration.Eval(context), [-9.81 + 0.5], rtol=1e-12)
