"""The table of approximations and pydrake's enumeration are of the same ones, and all of them step."""

import pytest

from sheldrake.geometry import Sphere
from sheldrake.math import RigidTransform
from sheldrake.multibody.contact_solvers._kernels.solve import APPROXIMATIONS
from sheldrake.multibody.plant import (
    AddMultibodyPlant,
    AddMultibodyPlantSceneGraph,
    CoulombFriction,
    DiscreteContactApproximation,
    DiscreteContactSolver,
    MultibodyPlantConfig,
)
from sheldrake.multibody.plant._parts import parts_of
from sheldrake.multibody.tree import RevoluteJoint, SpatialInertia
from sheldrake.systems.framework import DiagramBuilder


def test_each_approximation_has_its_enumerator_and_each_enumerator_its_record():
    names = {kind.name for kind in DiscreteContactApproximation}
    assert names == {f"k{name.capitalize()}" for name in APPROXIMATIONS}
    assert all(kind._made_of is APPROXIMATIONS[kind.name[1:].lower()] for kind in DiscreteContactApproximation)


@pytest.mark.parametrize("name", APPROXIMATIONS)
def test_a_configuration_chooses_it_by_name(name):
    config = MultibodyPlantConfig(discrete_contact_approximation=name)
    plant, _ = AddMultibodyPlant(config, DiagramBuilder())
    assert plant.get_discrete_contact_approximation().name.lower() == f"k{name}"
    knows_rows = plant.get_discrete_contact_solver() is DiscreteContactSolver.kSap
    assert knows_rows is APPROXIMATIONS[name].scalar_rows


@pytest.mark.parametrize("name", APPROXIMATIONS)
def test_contacts_are_seen_no_farther_than_a_step_needs(name):
    """What is seen ahead is searched for: more than a few falls or slides of a step would be in vain."""
    margin = APPROXIMATIONS[name].margin
    assert 0.0 < margin(1e-4) <= margin(1e-2) <= 0.03


def test_plants_whose_solvers_are_the_same_share_their_constants():
    def constants(joints=2, dt=1e-3, approximation=DiscreteContactApproximation.kLagged, balls=0, stiction=1e-3):
        builder = DiagramBuilder()
        plant, _ = AddMultibodyPlantSceneGraph(builder, dt)
        plant.set_discrete_contact_approximation(approximation)
        plant.set_stiction_tolerance(stiction)
        parent = plant.world_body()
        for k in range(joints):
            body = plant.AddRigidBody(f"link{k}", SpatialInertia.SolidSphereWithMass(1.0 + k, 0.1))
            plant.AddJoint(RevoluteJoint(f"joint{k}", parent.body_frame(), body.body_frame(), [0.0, 1.0, 0.0]))
            parent = body
        for k in range(balls):
            owner = plant.world_body() if k else parent
            plant.RegisterCollisionGeometry(owner, RigidTransform(), Sphere(0.1), f"{k}", CoulombFriction(1.0, 1.0))
        plant.Finalize()
        models = parts_of(plant).kernel_models
        builder.Build()
        return models.solver_model(models.compiled_geometry())

    one = constants()
    assert constants() is one
    assert not any(array.flags.writeable for array in one)
    others = [
        constants(joints=3),
        constants(dt=2e-3),
        constants(approximation=DiscreteContactApproximation.kSap),
        constants(balls=2),
        constants(stiction=2e-3),
    ]
    assert len({id(model) for model in (one, *others)}) == 6
    assert (others[1].dt, others[4].stiction) == (2e-3, 2e-3)
    assert (one.max_iterations, others[3].max_iterations) == (100, 500)  # as Drake does, and until it rests
