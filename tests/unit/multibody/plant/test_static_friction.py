"""Static friction of CENIC's steps: the coefficient is that of the slip at the start of the step."""

import pytest
from tests.unit.multibody.plant.free_bodies import FreeBodies, box_inertia

from sheldrake.common.chain import Chain
from sheldrake.geometry import Sphere
from sheldrake.multibody.contact_solvers._kernels.laws import static_share
from sheldrake.multibody.plant._kernels.contacts import static_friction
from sheldrake.multibody.plant._step.stages import discrete_stages

R, FASTER = 0.1, 40.0  # [m], static over dynamic friction


def scene():
    """Two balls over a ground, and their step as far as static friction."""
    ball = (Sphere(R), 1.0, (0.0, 0.0, 0.0), box_inertia(1.0, (R, R, R)))
    bodies = FreeBodies([ball, ball], mu=0.1, ground_mu=0.1)
    for g in range(len(bodies.geometry.geometry)):
        bodies.geometry[g].friction_static = FASTER * 0.1
    stages = discrete_stages(bodies.geometry, bodies.plant)
    names = [stage.__name__ for stage in stages]
    bodies.chain = Chain([*stages[: names.index("contact_constraints") + 1], static_friction])
    return bodies


def friction(bodies, z, v):
    """Of the first contact of balls at these heights, with these velocities."""
    bodies.q[:, 6], bodies.v[:] = z, 0.0
    bodies.v[:, 3] = v
    assert bodies.chain.bind(**bodies.arguments())() == 0
    assert bodies.work.problem.num_contacts == 1
    return bodies.work.contacts[0].friction


@pytest.mark.parametrize("touched", [False, True])
def test_it_is_that_of_the_slip_whatever_stood_there_before(touched):
    """Two balls touched each other, now one touches the ground: the other one's motion is nothing to it."""
    bodies, slip = scene(), 1e-3
    if touched:
        friction(bodies, [10.0, 10.0 + 1.99 * R], [0.0, 0.0])
        bodies.work.contacts[0].sixes, bodies.work.contacts[0].in_sixes = 2, 12  # as the step has left it
    share = static_share(slip / bodies.solver.stiction)
    found = friction(bodies, [0.99 * R, 50.0], [slip, 3.0])
    assert found == pytest.approx(0.1 + share * (FASTER - 1.0) * 0.1, rel=1e-9)
    assert 0.2 < found < 3.9


def test_what_slides_fast_has_dynamic_friction():
    """Less a quarter of a percent of what static friction is more: the curve of Kurtz and Castro is scaled at rest."""
    assert friction(scene(), [0.99 * R, 50.0], [5.0, 0.0]) == pytest.approx(0.1, abs=0.0026 * (FASTER - 1.0) * 0.1)


def test_what_does_not_slip_has_static_friction():
    assert friction(scene(), [0.99 * R, 50.0], [0.0, 0.0]) == pytest.approx(FASTER * 0.1, rel=1e-6)
