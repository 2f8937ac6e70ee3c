"""Queries whose words come from those of other arrays of the same shapes: they do what others do."""

from __future__ import annotations

import copy
from typing import NamedTuple

import numpy as np
import pytest

from sheldrake.common._native import builtin
from sheldrake.common._native import templates as templates_module
from sheldrake.common._native.templates import Packed, Templates
from sheldrake.common.calls import Calls
from sheldrake.common.kernel import IntVector, Matrix, Vector, jit_enabled, kernel
from sheldrake.math import RigidTransform
from sheldrake.multibody.plant import MultibodyPlant
from sheldrake.multibody.tree import RevoluteJoint, SpatialInertia

pytestmark = pytest.mark.skipif(not jit_enabled() or not builtin.available(), reason="no builtin functions here")


@pytest.fixture(autouse=True)
def _nothing_is_known(monkeypatch):
    monkeypatch.setattr(templates_module, "_kinds", {})


class Gains(NamedTuple):
    K: Matrix
    d: Vector


class Room(NamedTuple):
    y: Vector
    z: Matrix


@kernel(top=True)
def first(model: Gains, room: Room, x: Vector, runs: IntVector) -> int:
    runs[0] += 1
    for i in range(room.y.shape[0]):
        room.y[i] = model.d[i]
        for j in range(x.shape[0]):
            room.y[i] += model.K[i, j] * x[j]
    return 0


@kernel(top=True)
def second(model: Gains, room: Room, b: Vector, scale: float, out: Vector) -> int:
    for i in range(out.shape[0]):
        room.z[1, i] = scale * room.y[i]
        out[i] = room.z[1, i] + b[i] + model.d[i]
    return 0


MODEL = Gains(np.array([[1.0, 2.0], [3.0, 4.0]]), np.array([0.5, -0.5]))


class Setup:
    def __init__(self, templates: Templates, scale: float = 2.0, model: Gains = MODEL, size: int = 2) -> None:
        self.room, memory = Packed(Room(np.zeros(2), np.zeros((2, 2)))).new()
        self.x, self.out, self.runs, self.counter = (
            np.arange(1.0, size + 1), np.zeros(2), np.zeros(1, np.int64), np.zeros(1, np.int64)
        )  # fmt: skip
        self.calls = Calls(self.counter, templates=templates, packed=(self.room, memory))
        bit = self.calls.stage(first, model, self.room, self.x, self.runs)
        arguments = model, self.room, np.zeros(2), scale, self.out
        self.ask = self.calls.query(second, *arguments, given=("b",), needs=bit, answer=self.out)


def expected(x, scale=2.0, model=MODEL):
    return scale * (model.d + model.K @ x) + 10.0 + model.d


B = np.full(2, 10.0)


def test_each_set_of_arrays_has_its_own_numbers():
    templates = Templates(MODEL)
    setups = [Setup(templates) for _ in range(4)]
    for k, s in enumerate(setups):
        s.x[:] = k, -2.0 * k
    for s in setups:
        assert np.array_equal(s.ask(B), expected(s.x)) and s.runs[0] == 1
    setups[2].x[:] = 7.0
    setups[2].counter[0] += 1
    assert [s.ask(B).tolist() for s in setups] == [expected(s.x).tolist() for s in setups]
    assert [int(s.runs[0]) for s in setups] == [1, 1, 2, 1]
    assert len(templates._known) == 2  # one of the stage, one of the query


def test_the_arrays_of_a_set_live_as_long_as_its_query():
    templates = Templates(MODEL)
    asks = [Setup(templates).ask for _ in range(20)]
    for ask in asks:
        assert np.array_equal(ask(B), expected(np.array([1.0, 2.0])))


@pytest.mark.parametrize("scale", [3.0, 0.0, -0.0, np.float64(3.0)])
def test_other_numbers_are_not_taken_for_the_same(scale):
    templates = Templates(MODEL)
    Setup(templates, 0.0), Setup(templates, -0.0), Setup(templates, 2.0)
    s = Setup(templates, scale)
    found = s.ask(B)
    assert np.array_equal(found, expected(s.x, scale))
    assert np.signbit(s.room.z[1, 0]) == np.signbit(scale)


def test_other_shapes_and_models_are_not_taken_for_the_same():
    templates = Templates(MODEL)
    Setup(templates)
    other = Gains(MODEL.K + 1.0, MODEL.d - 3.0)
    for _ in range(2):
        s = Setup(templates, model=other)
        assert np.array_equal(s.ask(B), expected(s.x, model=other))
    wide = Gains(np.ones((2, 3)), MODEL.d)
    s = Setup(templates, model=wide, size=3)
    assert np.array_equal(s.ask(B), expected(s.x, model=wide))


def test_wrong_arrays_are_refused_though_a_template_is_known():
    s = Setup(templates := Templates(MODEL))
    for wrong in (np.zeros(4)[::2], np.zeros(2, np.int64), np.zeros(2, complex), [0.0, 0.0]):
        with pytest.raises((TypeError, AttributeError)):
            s.calls.query(second, MODEL, s.room, np.zeros(2), 2.0, wrong, given=("b",))
    assert len(templates._known) == 2


def test_copies_of_templates_know_their_own_models_only():
    templates = Templates(MODEL)
    for other in (copy.deepcopy(templates), copy.copy(templates)):
        ((_, model, _),) = other._fixed.values()
        assert list(other._fixed) == [id(model)]


def test_systems_with_models_of_the_same_shapes_share_templates_and_keep_their_numbers():
    models = [Gains(MODEL.K + k, MODEL.d - 3.0 * k) for k in range(4)]
    setups = [Setup(Templates(model), model=model) for model in models]
    for s, model in zip(setups, models):
        assert np.array_equal(s.ask(B), expected(s.x, model=model))
        assert len(s.calls._templates._known) == 2
    strange = Gains(np.asfortranarray(MODEL.K), MODEL.d)
    with pytest.raises(TypeError, match="C-contiguous"):
        Setup(Templates(strange), model=strange)


def test_templates_of_few_kinds_of_systems_are_kept():
    for k in range(80):
        model = Gains(np.ones((2, 2 + k)), MODEL.d)
        s = Setup(Templates(model), model=model, size=2 + k)
        assert np.array_equal(s.ask(B), expected(s.x, model=model))
    assert len(templates_module._kinds) == 64


def test_templates_do_not_grow_without_end():
    templates = Templates(MODEL)
    for k in range(600):
        s = Setup(templates, float(k))
    assert len(templates._known) <= 512 and np.array_equal(s.ask(B), expected(s.x, 599.0))


def arm() -> MultibodyPlant:
    plant = MultibodyPlant(0.0)
    parent = plant.world_body()
    for k in range(3):
        body = plant.AddRigidBody(f"b{k}", SpatialInertia.SolidBoxWithMass(1.0 + k, 0.1, 0.2, 0.3))
        joint = RevoluteJoint(f"j{k}", parent.body_frame(), body.body_frame(), [0.0, 1.0, 0.1 * k], 0.1)
        plant.AddJoint(joint)
        parent = plant.AddRigidBody(f"e{k}", SpatialInertia.SolidBoxWithMass(0.5, 0.1, 0.2, 0.3))
        plant.WeldFrames(body.body_frame(), parent.body_frame(), RigidTransform([0.0, 0.1, 0.4]))
    plant.Finalize()
    return plant


def numbers_of(plant: MultibodyPlant, context, q: np.ndarray) -> list[np.ndarray]:
    """What queries of many kinds say."""
    last = plant.GetBodyByName("e2").body_frame()
    world = plant.world_frame()
    plant.SetPositions(context, q)
    plant.SetVelocities(context, 0.5 * q)
    return [
        plant.CalcGravityGeneralizedForces(context),
        plant.CalcMassMatrix(context),
        plant.CalcBiasTerm(context),
        plant.CalcPointsPositions(context, last, np.eye(3), world),
        plant.CalcCenterOfMassPositionInWorld(context),
        plant.CalcCenterOfMassTranslationalVelocityInWorld(context),
        last.CalcPoseInWorld(context).GetAsMatrix34(),
        last.CalcSpatialVelocityInWorld(context).get_coeffs(),
        np.array([plant.CalcKineticEnergy(context), plant.CalcPotentialEnergy(context)]),
        plant.GetPositionsAndVelocities(context),
    ]


def test_contexts_of_a_plant_are_apart():
    plant = arm()
    base = plant.CreateDefaultContext()
    contexts = [base, base.Clone(), plant.CreateDefaultContext(), base.Clone()]
    rng = np.random.default_rng(3)
    qs = [rng.normal(size=3) for _ in contexts]
    for k, context in enumerate(contexts):
        plant.GetBodyByName("e2").SetMass(context, 1.0 + k)
    found = [numbers_of(plant, c, q) for c, q in zip(contexts, qs)]
    again = [numbers_of(plant, c, q) for c, q in zip(contexts, qs)]
    for k, q in enumerate(qs):
        fresh = arm()  # the first context of a plant has no templates
        context = fresh.CreateDefaultContext()
        fresh.GetBodyByName("e2").SetMass(context, 1.0 + k)
        for a, b, c in zip(found[k], again[k], numbers_of(fresh, context, q)):
            assert np.array_equal(a, c) and np.array_equal(b, c)


@pytest.mark.parametrize("values", [[0.1, 0.2, 0.3], [1, 2, 3], [1, 0.5, True], (0.1, 0.2, 0.3)])
def test_positions_may_be_given_as_a_list(values):
    plant = arm()
    context = plant.CreateDefaultContext()
    for _ in range(2):
        plant.SetPositions(context, np.zeros(3))
        plant.SetPositions(context, values)
        assert plant.GetPositions(context).tolist() == [float(v) for v in values]


@pytest.mark.parametrize(
    "values", [[0.1, 0.2], [[0.1, 0.2, 0.3]] * 2, ["a", "b", "c"], [0.1, [0.2], 0.3], [np.nan] * 3]
)
def test_lists_that_are_no_positions_are_refused(values):
    plant = arm()
    context = plant.CreateDefaultContext()
    plant.SetPositions(context, np.ones(3))
    with pytest.raises((RuntimeError, TypeError, ValueError)):
        plant.SetPositions(context, values)
    assert plant.GetPositions(context).tolist() == [1.0] * 3


def loose(*masses: float) -> MultibodyPlant:
    """Bodies that move freely."""
    plant = MultibodyPlant(0.0)
    for k, mass in enumerate(masses):
        plant.AddRigidBody(f"b{k}", SpatialInertia.SolidBoxWithMass(mass, 0.1, 0.2, 0.3))
    plant.Finalize()
    return plant


def test_plants_built_alike_share_what_was_bound_and_have_their_own_masses():
    plants = [loose(1.0, 2.0), loose(3.0, 5.0), loose(4.0)]
    contexts = [plant.CreateDefaultContext() for plant in plants]
    diagonals = [np.diag(plant.CalcMassMatrix(c)) for plant, c in zip(plants, contexts)]
    assert [d[3::6].tolist() for d in diagonals] == [[1.0, 2.0], [3.0, 5.0], [4.0]]
    models = [plant._parts.elements.model("test") for plant in plants]
    assert models[0].templates._known is models[1].templates._known is not models[2].templates._known
    assert models[0].blank_work is models[1].blank_work is not models[2].blank_work
    plants[1].SetFreeBodyPose(contexts[1], plants[1].GetBodyByName("b0"), RigidTransform([1.0, 2.0, 3.0]))
    for plant, context, x in zip(plants, contexts, (0.0, 1.0, 0.0)):
        assert plant.EvalBodyPoseInWorld(context, plant.GetBodyByName("b0")).translation()[0] == x
