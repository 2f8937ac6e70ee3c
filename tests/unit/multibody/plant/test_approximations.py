"""The table of approximations and pydrake's enumeration are of the same ones, and all of them step."""

import pytest

from sheldrake.multibody.contact_solvers._kernels.solve import APPROXIMATIONS
from sheldrake.multibody.plant import (
    AddMultibodyPlant,
    DiscreteContactApproximation,
    DiscreteContactSolver,
    MultibodyPlantConfig,
)
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
