"""One set of queries serves all contexts that are laid out alike, of plants whose trees are alike."""

from __future__ import annotations

import concurrent.futures
import copy
import gc
import weakref

import numpy as np
import pytest

from sheldrake.common._native import builtin
from sheldrake.common.kernel import jit_enabled
from sheldrake.math import RigidTransform
from sheldrake.multibody.math import SpatialInertia
from sheldrake.multibody.plant import MultibodyPlant
from sheldrake.multibody.plant._context.queries import work_in
from sheldrake.multibody.tree import FixedOffsetFrame, JacobianWrtVariable, RevoluteJoint

pytestmark = pytest.mark.skipif(not jit_enabled() or not builtin.available(), reason="no builtin functions here")


def pendulum(mass=1.0, length=0.5, links=3, branches=False, floating=False, dt=0.001, name="plant"):
    """A chain of links, or links that all hang from the world or from a floating body."""
    plant = MultibodyPlant(dt)
    plant.set_name(name)
    root = parent = plant.world_body()
    if floating:
        root = parent = plant.AddRigidBody("base", SpatialInertia.SolidSphereWithMass(2.0, 0.3))
    for k in range(links):
        body = plant.AddRigidBody(f"link{k}", SpatialInertia.SolidBoxWithMass(mass, 0.1, 0.2, length))
        on = (root if branches else parent).body_frame()
        mount = plant.AddFrame(FixedOffsetFrame(f"mount{k}", on, RigidTransform([0.1 * k, 0.0, -length])))
        plant.AddJoint(RevoluteJoint(f"joint{k}", mount, body.body_frame(), [0.0, 1.0, 0.0]))
        parent = body
    plant.Finalize()
    return plant


def answers(plant, context):
    """All kinds of answers, one after the other."""
    body, world, vdot = plant.GetBodyByName("link1"), plant.world_frame(), np.linspace(1.0, 2.0, plant.num_velocities())
    frame, kV = body.body_frame(), JacobianWrtVariable.kV
    V = plant.EvalBodySpatialVelocityInWorld(context, body)
    pose, other = plant.EvalBodyPoseInWorld(context, body), plant.CalcRelativeTransform(context, frame, world)
    found = [
        plant.CalcMassMatrix(context),
        plant.CalcBiasTerm(context),
        plant.CalcGravityGeneralizedForces(context),
        pose.rotation().matrix(),
        pose.translation(),
        other.rotation().matrix(),
        V.get_coeffs(),
        frame.CalcSpatialVelocity(context, world, world).get_coeffs(),
        plant.CalcJacobianSpatialVelocity(context, kV, frame, np.array([0.1, 0.2, 0.3]), world, world),
        plant.CalcJacobianCenterOfMassTranslationalVelocity(context, kV, world, world),
        plant.CalcCenterOfMassPositionInWorld(context),
        plant.CalcSpatialMomentumInWorldAboutPoint(context, np.zeros(3)).get_coeffs(),
        plant.CalcSpatialInertia(context, world, [body.index()]).CopyToFullMatrix6(),
        [A.get_coeffs() for A in plant.CalcSpatialAccelerationsFromVdot(context, vdot)],
        [plant.CalcKineticEnergy(context), plant.CalcPotentialEnergy(context), plant.CalcTotalMass(context)],
    ]
    return np.concatenate([np.ravel(numbers) for numbers in found]).tobytes()


def moved(plant, context, seed):
    generator = np.random.default_rng(seed)
    q, v = generator.uniform(-1.0, 1.0, plant.num_positions()), generator.uniform(-1.0, 1.0, plant.num_velocities())
    plant.SetPositions(context, q)
    plant.SetVelocities(context, v)
    return context


def alone(monkeypatch, plant, seed):
    """Answers of a new context with queries of its own."""
    with monkeypatch.context() as only:
        only.setattr(builtin, "available", lambda: False)
        context = moved(plant, plant.CreateDefaultContext(), seed)
        return answers(plant, context)


def queries_of(plant, context):
    return plant._parts.contexts.view(context).queries


@pytest.mark.parametrize("dt", [0.0, 0.001])
@pytest.mark.parametrize("floating", [False, True])
def test_contexts_of_plants_alike_share_queries_and_have_answers_of_their_own(monkeypatch, dt, floating):
    plants = [pendulum(mass, length, floating=floating, dt=dt) for mass, length in ((1.0, 0.5), (3.0, 0.2))]
    contexts = [(plant, moved(plant, plant.CreateDefaultContext(), seed), seed) for plant in plants for seed in (1, 2)]
    assert len({id(queries_of(plant, context)) for plant, context, _ in contexts}) == 1
    for _ in range(2):  # by turns: the second time everything is there
        for plant, context, seed in contexts:
            assert answers(plant, context) == alone(monkeypatch, plant, seed)


def test_trees_that_branch_otherwise_have_queries_of_their_own(monkeypatch):
    chain, star = pendulum(), pendulum(branches=True)
    contexts = [moved(plant, plant.CreateDefaultContext(), 3) for plant in (chain, star)]
    assert np.all(chain.CalcMassMatrix(contexts[0]) != 0.0)
    M = star.CalcMassMatrix(contexts[1])
    np.testing.assert_array_equal(M, np.diag(np.diag(M)))
    assert answers(star, contexts[1]) == alone(monkeypatch, star, 3)
    assert queries_of(chain, contexts[0]) is not queries_of(star, contexts[1])


def test_a_clone_knows_what_was_computed_and_goes_its_own_way(monkeypatch):
    plant = pendulum()
    first = moved(plant, plant.CreateDefaultContext(), 1)
    expected = answers(plant, first)
    clone = first.Clone()
    rooms = [context._store.rooms[context._node] for context in (first, clone)]
    assert rooms[1] is not rooms[0] and rooms[1].tobytes() == rooms[0].tobytes()
    work_in(rooms[1], plant._parts.elements.model("test"))[0].X_WB[:] *= 2.0
    # nothing is computed once more: it is what was kept that is read
    poses = [
        plant.EvalBodyPoseInWorld(context, plant.GetBodyByName("link1")).translation() for context in (first, clone)
    ]
    np.testing.assert_array_equal(poses[1], 2.0 * poses[0])
    moved(plant, clone, 2)
    assert answers(plant, clone) == alone(monkeypatch, plant, 2)
    assert answers(plant, first) == expected


def test_writes_are_noticed_by_what_names_the_state():
    plant = pendulum()
    context = plant.CreateDefaultContext()
    port = plant.get_body_poses_output_port()
    before = port.Eval(context)
    for seed in range(3):
        moved(plant, context, seed)
        X_WB = port.Eval(context)[2]
        assert not X_WB.IsExactlyEqualTo(before[2])
        assert X_WB.IsExactlyEqualTo(plant.EvalBodyPoseInWorld(context, plant.GetBodyByName("link1")))


def test_what_cannot_be_is_told_of_the_plant_that_was_asked():
    plants = [pendulum(floating=True, name=name) for name in ("one", "other")]
    for plant in plants:
        context = plant.CreateDefaultContext()
        plant.CalcMassMatrix(context)
        plant.SetPositions(context, np.zeros(plant.num_positions()))
        with pytest.raises(RuntimeError, match=f"::{plant.get_name()} .*'base"):
            plant.CalcMassMatrix(context)


def test_a_query_keeps_the_memory_it_is_bound_to():
    plant = pendulum()
    context = moved(plant, plant.CreateDefaultContext(), 1)
    expected, ask = plant.CalcMassMatrix(context), plant._parts.contexts.view(context).ask_mass_matrix
    del context
    gc.collect()
    assert ask().tobytes() == expected.tobytes()


def test_memory_goes_with_the_context():
    plant = pendulum()
    context = moved(plant, plant.CreateDefaultContext(), 1)
    answers(plant, context)
    gone = weakref.ref(context._store)
    del context
    gc.collect()
    assert gone() is None


def test_threads_may_ask_contexts_of_one_plant():
    plant = pendulum()
    contexts = [moved(plant, plant.CreateDefaultContext(), seed) for seed in range(4)]
    expected = [answers(plant, context) for context in contexts]

    def ask(k):
        return all(answers(plant, moved(plant, contexts[k], k)) == expected[k] for _ in range(30))

    with concurrent.futures.ThreadPoolExecutor(4) as pool:
        assert all(pool.map(ask, range(4)))


def test_models_that_come_where_others_were_are_told_from_them(monkeypatch):
    """Addresses are used again; what machine code remembers of the last call must not."""
    for k in range(20):
        plant = pendulum(mass=1.0 + k)
        context = moved(plant, plant.CreateDefaultContext(), 1)
        assert answers(plant, context) == alone(monkeypatch, plant, 1)
        del plant, context
        gc.collect()


def test_copies_of_the_model_find_their_own_arrays():
    plant = pendulum()
    model = plant._parts.elements.model("test")
    there = model.addresses
    assert "addresses" in vars(model) and "addresses" not in vars(copy.copy(model))
    assert there.arrays[0] is model.tree.body
