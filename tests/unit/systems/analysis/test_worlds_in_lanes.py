"""Worlds that run rows four at a time have the bits they have alone, in all memory that is read, whatever others do."""

import numpy as np
import pytest

import sheldrake
from sheldrake.common.kernel import jit_enabled
from sheldrake.geometry import Box, HalfSpace, Sphere
from sheldrake.math import RigidTransform, RollPitchYaw
from sheldrake.multibody.contact_solvers._kernels.problem import ContactState, Counts
from sheldrake.multibody.math import SpatialInertia
from sheldrake.multibody.parsing import Parser
from sheldrake.multibody.plant import AddMultibodyPlantSceneGraph, CoulombFriction, MultibodyPlant
from sheldrake.multibody.tree import (
    BallRpyJoint,
    DoorHinge,
    DoorHingeConfig,
    LinearBushingRollPitchYaw,
    LinearSpringDamper,
    PdControllerGains,
    PlanarJoint,
    PrismaticJoint,
    RevoluteJoint,
    RevoluteSpring,
    ScrewJoint,
    UniversalJoint,
)
from sheldrake.systems.analysis import BatchSimulator, Simulator
from sheldrake.systems.framework import DiagramBuilder

pytestmark = pytest.mark.skipif(not jit_enabled(), reason="lanes are machine code")


def quadruped():
    """A quadruped on a floor, its motors under PD control, some of which are weak: diagram and plant."""
    builder = DiagramBuilder()
    plant, _ = AddMultibodyPlantSceneGraph(builder, 1e-3)
    Parser(plant).AddModels(sheldrake.model_path("quadruped/quadruped.urdf"))
    floor = plant.world_body(), RigidTransform(), HalfSpace(), "floor", CoulombFriction(0.8, 0.8)
    plant.RegisterCollisionGeometry(*floor)
    for k in plant.GetJointActuatorIndices():
        plant.get_joint_actuator(k).set_controller_gains(PdControllerGains(p=300.0, d=8.0))
    plant.Finalize()
    builder.ExportInput(plant.get_desired_state_input_port(plant.GetModelInstanceByName("quadruped")), "wanted")
    return builder.Build(), plant


def everything(approximation="kLagged"):
    """Joints of all kinds, springs, a hinge, a strut, a bushing, limits, a free body on a table: diagram and plant."""
    builder = DiagramBuilder()
    plant, _ = AddMultibodyPlantSceneGraph(builder, 2e-3)
    plant.set_discrete_contact_approximation(
        getattr(sheldrake.multibody.plant.DiscreteContactApproximation, approximation)
    )
    inertia = SpatialInertia.SolidBoxWithMass(1.3, 0.3, 0.2, 0.4)
    x, z = [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]
    kinds = (
        lambda name, a, b: RevoluteJoint(name, a, b, [0.6, 0.0, 0.8], -0.2, 0.2, damping=0.1),
        lambda name, a, b: PrismaticJoint(name, a, b, x, -0.1, 0.1, damping=0.2),
        lambda name, a, b: BallRpyJoint(name, a, b, damping=0.05),
        lambda name, a, b: UniversalJoint(name, a, b, damping=0.05),
        lambda name, a, b: ScrewJoint(name, a, b, z, 0.05, 0.1),
        lambda name, a, b: PlanarJoint(name, a, b, [0.1, 0.1, 0.1]),
    )
    bodies = [plant.world_body()]
    for k, kind in enumerate(kinds):
        bodies.append(plant.AddRigidBody(f"link{k}", inertia))
        plant.AddJoint(kind(f"joint{k}", bodies[-2].body_frame(), bodies[-1].body_frame()))
    tip = plant.AddRigidBody("tip", inertia)
    plant.WeldFrames(
        bodies[-1].body_frame(), tip.body_frame(), RigidTransform(RollPitchYaw(0.1, 0.2, 0.3), [0.1, 0, 0.2])
    )
    free = plant.AddRigidBody("free", inertia)
    plant.RegisterCollisionGeometry(free, RigidTransform(), Sphere(0.1), "ball", CoulombFriction(0.5, 0.5))
    table = (
        plant.world_body(),
        RigidTransform([0.0, 0.0, -0.15]),
        Box(4.0, 4.0, 0.1),
        "table",
        CoulombFriction(0.5, 0.5),
    )
    plant.RegisterCollisionGeometry(*table)
    first, second = (plant.GetJointByName(f"joint{k}") for k in (0, 1))
    plant.AddJointActuator("motor", first, 2.0).set_controller_gains(PdControllerGains(p=30.0, d=1.0))
    plant.AddJointActuator("push", second)
    plant.AddForceElement(RevoluteSpring(first, 0.1, 5.0))
    plant.AddForceElement(DoorHinge(first, DoorHingeConfig()))
    plant.AddForceElement(LinearSpringDamper(bodies[1], [0.1, 0, 0], free, [0, 0.1, 0], 0.3, 20.0, 0.5))
    frames = bodies[2].body_frame(), free.body_frame()
    plant.AddForceElement(LinearBushingRollPitchYaw(*frames, [3.0] * 3, [0.1] * 3, [9.0] * 3, [0.2] * 3))
    plant.Finalize()
    return builder.Build(), plant


def arm():
    """A pendulum of two links that can be locked: diagram and plant."""
    plant = MultibodyPlant(1e-3)
    end = plant.world_frame()
    for k in range(2):
        link = plant.AddRigidBody(f"link{k}", SpatialInertia.ThinRodWithMassAboutEnd(1.0, 0.5, [0.0, 0.0, -1.0]))
        joint = RevoluteJoint(f"joint{k}", end, link.body_frame(), [0.0, 1.0, 0.0], -0.4, 0.4)
        plant.AddJoint(joint)
        end = link.body_frame()
    plant.Finalize()
    return plant, plant


def batch_of(made, count, spread, seed=0):
    """A batch with random states, initialized, and who its row in lanes is."""
    diagram, plant = made
    batch = BatchSimulator(diagram, count, num_threads=1, raise_failures=False)
    rng = np.random.default_rng(seed)
    batch.states(plant)[:] += rng.uniform(-spread, spread, batch.states(plant).shape)
    return batch


def taken_in_lanes(batch, row=0):
    """Which worlds took their last step with others, in lanes: as far as this row of an update."""
    worlds = batch._worlds
    stamps = worlds.side[:, worlds.layout.stamp0 + worlds._lane_rows.rows[row]]
    return stamps == stamps.max() if stamps.any() else stamps > 0


def steps_in_lanes(batch, num_steps, row=0):
    """How many of the next steps, one by one, each world takes with others, in lanes: as far as this row of an update.

    The counters of rows that worlds have computed in lanes grow by these steps alone.
    """
    worlds = batch._worlds
    stamps = worlds.side[:, worlds.layout.stamp0 + worlds._lane_rows.rows[row]]
    found = np.zeros(batch.num_worlds(), int)
    for _ in range(num_steps):
        before = stamps.copy()
        batch.AdvanceSteps(1)
        found += stamps != before
    return found


def never_read(worlds):
    """Places of slabs that each solve writes before it reads them, if it needs them, and that nobody else reads."""
    store = worlds.model
    scratch = store.scratch(worlds.layout.rows[worlds._lane_rows.rows[0]].node)
    places = np.zeros(store.S.size, bool)
    iterations = scratch.problem.count[Counts.iterations : Counts.participating]
    for array in (*scratch.factor, scratch.problem.dv, scratch.problem.a_dv, iterations):
        at = (array.ctypes.data - store.S.ctypes.data) // 8
        places[at : at + array.size] = True
    state = scratch.contacts.state
    at = (state.ctypes.data - store.S.ctypes.data) // 8
    first = at + np.arange(len(state))[:, None] * state.shape[1]
    for columns in (ContactState.dvc.columns, ContactState.dual.columns):
        places[first + np.arange(columns.start, columns.stop)] = True
    return places


def assert_as_alone(batch, diagram, advance, who=None):
    """Worlds that have been advanced are, in all memory that is read, what simulators make of the same contexts."""
    clones = [batch.context(w).Clone() for w in range(batch.num_worlds())]
    advance()
    read = ~never_read(batch._worlds)
    for w in range(batch.num_worlds()) if who is None else who:
        if batch.failed[w]:
            continue
        simulator = Simulator(diagram, clones[w])
        simulator.Initialize()
        simulator.AdvanceTo(batch.times[w])
        alone, found = clones[w]._store.S.view(np.int64), batch._worlds.S[w].view(np.int64)
        np.testing.assert_array_equal(alone[read], found[read])


STANCE = np.tile([0.0, 0.7, -1.4], 4)


@pytest.mark.parametrize("count", [4, 7, 12])
def test_quadrupeds_that_walk_into_limits_and_saturate(count):
    """In some steps four of them do the same, in others they do not."""
    diagram, plant = made = quadruped()
    batch = batch_of(made, count, 0.02)
    random = np.random.default_rng(1)
    batch.states(plant)[:, 6] = np.linspace(0.36, 0.38, count)
    batch.states(plant)[:, 7:19] += STANCE
    wanted = STANCE + random.uniform(-1.5, 1.5, 12) + random.uniform(-0.2, 0.2, (count, 12))
    batch.inputs(diagram.get_input_port())[:] = np.hstack([wanted, np.zeros((count, 12))])
    assert (np.abs(300.0 * (wanted - batch.states(plant)[:, 7:19])).max(axis=1) > plant.GetEffortUpperLimits()[0]).all()
    batch.Initialize()
    found = []
    assert_as_alone(batch, diagram, lambda: (found.append(steps_in_lanes(batch, 60)), batch.AdvanceSteps(60)))
    together, alone = np.split(found[0], [count // 4 * 4])
    assert (together >= 20).all() and (together <= 55).all() and not alone.any()
    q = batch.states(plant)[:, 7:19]
    lower, upper = plant.GetPositionLowerLimits()[7:], plant.GetPositionUpperLimits()[7:]
    assert ((q < lower + 1e-3) | (q > upper - 1e-3)).any(axis=1).all() and not batch.failed.any()


def standing(count):
    """Quadrupeds that stand, each a little different, and have done so for a while: batch, diagram and plant."""
    diagram, plant = made = quadruped()
    batch = batch_of(made, count, 0.0)
    x = batch.states(plant)
    x[:, 6], x[:, 7:19] = 0.36, STANCE
    x[:, 19:] = 0.02 * np.random.default_rng(3).normal(size=(count, 18))
    batch.inputs(diagram.get_input_port())[:] = np.concatenate([STANCE, np.zeros(12)])
    batch.Initialize()
    batch.AdvanceSteps(300)
    return batch, diagram, plant


def test_whole_steps_of_quadrupeds_that_stand():
    batch, diagram, _ = standing(8)
    assert_as_alone(batch, diagram, lambda: [batch.AdvanceSteps(n) for n in (1, 5, 30)])
    assert taken_in_lanes(batch, -2).all()


def test_contacts_that_worlds_have_in_lanes_are_reported():
    """Reports are made of what the last step left, which worlds that go together have in lanes until they part."""
    batch, _, plant = standing(4)
    robot = plant.GetModelInstanceByName("quadruped")
    batch.AdvanceSteps(10)
    assert taken_in_lanes(batch, -2).all()
    for w in range(4):
        context = plant.GetMyContextFromRoot(batch.context(w))
        results = plant.get_contact_results_output_port().Eval(context)
        forces = [results.point_pair_contact_info(k).contact_force()[2] for k in range(4)]
        assert results.num_point_pair_contacts() == 4
        weight = 9.81 * sum(plant.get_body(b).get_mass(context) for b in plant.GetBodyIndices(robot))
        assert abs(sum(forces)) == pytest.approx(weight, rel=0.05)


@pytest.mark.parametrize("approximation", ["kLagged", "kSimilar", "kSap", "kTamsi"])
def test_all_that_acts_in_a_plant(approximation):
    diagram, plant = made = everything(approximation)
    batch = batch_of(made, 8, 0.05)
    batch.states(plant)[:, plant.num_positions() :] *= 20.0
    assert_as_alone(batch, diagram, lambda: batch.AdvanceSteps(60))


def test_all_that_is_read_is_brought_into_lanes():
    diagram, _ = made = everything()
    batch = batch_of(made, 4, 0.02)
    batch.AdvanceSteps(1)
    ((first_row, all_rows),) = batch._native._lanes.values()
    kept = np.zeros(len(first_row.slab), bool)
    for lanes in (first_row, all_rows):
        for n in range(lanes.writes_begin, lanes.changes_begin):
            kept[lanes.pieces[n].start : lanes.pieces[n].start + lanes.pieces[n].length] = True
    first_row.slab[~kept] = np.nan
    assert_as_alone(batch, diagram, lambda: batch.AdvanceSteps(20))
    assert taken_in_lanes(batch).all()


@pytest.mark.parametrize("made", [quadruped, everything])
def test_stages_that_worlds_take_alone_read_nothing_that_is_in_lanes_yet(made):
    diagram, plant = system = made()
    batch = batch_of(system, 8, 0.05)
    if made is quadruped:
        batch.states(plant)[:, 6] = np.linspace(0.25, 0.4, 8)  # some touch the ground, each in its own way
        batch.inputs(diagram.get_input_port())[:] = np.random.default_rng(1).uniform(-0.9, 0.9, (8, 24))
    batch.AdvanceSteps(1)
    ((first_row, _),) = batch._native._lanes.values()
    pieces = [first_row.pieces[n] for n in range(first_row.later_begin, first_row.changes_begin)]
    assert sum(piece.length for piece in pieces) > 50

    def advance():
        for piece in pieces:
            batch._worlds.slab[:, piece.start : piece.start + piece.length] = np.nan
        batch.AdvanceSteps(40)

    assert_as_alone(batch, diagram, advance)
    assert not batch.failed.any()
    assert taken_in_lanes(batch).any()
    assert not taken_in_lanes(batch, -2).all()


def test_worlds_that_do_not_agree_go_alone():
    diagram, plant = made = arm()
    batch = batch_of(made, 8, 0.0)
    batch.states(plant)[:, 0] = [0.0, 0.1, 0.2, 0.1, 0.0, 0.398, 0.1, 0.2]
    batch.states(plant)[5, 2] = 5.0  # reaches its limit
    assert_as_alone(batch, diagram, lambda: batch.AdvanceSteps(3))
    assert taken_in_lanes(batch).tolist() == [True] * 4 + [False] * 4


@pytest.mark.parametrize("steps", [30, 100])
def test_a_world_at_rest_among_others_that_part(steps):
    """What its last step in lanes has left is there, although it takes no further one."""
    diagram, plant = made = arm()
    batch = batch_of(made, 4, 0.0)
    batch.states(plant)[1:, 0] = [0.1, 0.2, 0.3]
    batch.states(plant)[3, 2] = 2.0  # is at its limit after 55 steps
    batch.Initialize()
    assert_as_alone(batch, diagram, lambda: batch.AdvanceSteps(steps), [0])
    assert not np.any(batch.states(plant)[0]) and taken_in_lanes(batch, -2).all() == (steps == 30)


def test_a_world_without_numbers_does_not_hold_up_the_others():
    diagram, plant = made = arm()
    batch = batch_of(made, 8, 0.1)
    batch.states(plant)[2, 0] = np.nan
    assert_as_alone(batch, diagram, lambda: batch.AdvanceSteps(50))
    assert batch.failed.tolist() == [False, False, True] + [False] * 5
    assert taken_in_lanes(batch)[4:].all()


def test_masses_locks_and_times_of_worlds():
    diagram, plant = made = arm()
    batch = batch_of(made, 8, 0.1)
    for w in range(8):
        plant.get_body(sheldrake.multibody.tree.BodyIndex(1)).SetMass(batch.context(w), 1.0 + w)
    plant.GetJointByName("joint1").Lock(batch.context(3))
    batch.states(plant)[3, 3] = 0.0
    batch.SetTime(0.01 * np.arange(8))
    assert_as_alone(batch, diagram, lambda: batch.AdvanceSteps(40))
    assert taken_in_lanes(batch)[4:].all()


def test_subsets_and_parts_of_rollouts():
    diagram, _ = made = arm()
    batch = batch_of(made, 11, 0.1)
    who = [0, 3, 4, 7, 8, 10]
    assert_as_alone(batch, diagram, lambda: [batch.AdvanceSteps(n, who) for n in (1, 7, 30)], who)
    assert batch.times.tolist() == pytest.approx([0.038 if w in who else 0.0 for w in range(11)])


@pytest.mark.parametrize("threads", [1, 2, 3])
@pytest.mark.parametrize("seconds", [0.0, 1e-6, 2e-5, 0.1])
def test_parts_that_threads_take_become_shorter_and_split_no_four(threads, seconds):
    diagram, _ = arm()
    native = BatchSimulator(diagram, 256, num_threads=threads)._native
    native._seconds = seconds  # that a world took last
    for count in (0, 1, 11, 64, 251, 256):
        ends = native._ends_of_parts(count)
        sizes = np.diff(ends)
        assert ends[0] == 0 and ends[-1] == count and (sizes > 0).all()
        assert (np.diff(sizes) <= 0).all()
        if count >= 4 * threads:
            assert all(end % 4 == 0 for end in ends[:-1])
            assert len(sizes) >= threads or seconds == 1e-6  # what takes no time need not be shared
