"""How exactly the steps of a robot with contact are solved: what it does, and what it rests on."""

from __future__ import annotations

import numpy as np

from sheldrake import model_path
from sheldrake.all import (
    AddMultibodyPlantSceneGraph,
    CoulombFriction,
    DiagramBuilder,
    HalfSpace,
    Parser,
    RigidTransform,
    Simulator,
)

RESTS, MOVES = 1e-9, 1e-6


def test_a_quadruped_that_falls_and_rests_is_solved_as_well_as_it_moves():
    """The residual is 1e-6 of the momentum, or 1e-9 of momentum and impulses: at rest there is no momentum."""
    builder = DiagramBuilder()
    plant, _ = AddMultibodyPlantSceneGraph(builder, 1e-3)
    Parser(plant).AddModels(model_path("quadruped/quadruped.urdf"))
    ground = plant.world_body(), RigidTransform([0.0, 0.0, -0.3]), HalfSpace(), "ground"
    plant.RegisterCollisionGeometry(*ground, CoulombFriction(1.0, 1.0))
    plant.Finalize()
    simulator = Simulator(builder.Build())
    context = plant.GetMyContextFromRoot(simulator.get_context())
    touched = 0
    for k in range(1, 401):
        simulator.AdvanceTo(1e-3 * k)
        problem = context._store.scratch(context._node).problem
        if problem.num_contacts == 0:
            continue
        touched += 1
        m = problem.mobility
        residual, momentum, impulse = (
            np.sqrt(np.sum(m * x * x)) for x in (problem.gradient, problem.p, problem.j_gamma)
        )
        assert residual <= 1.01 * max(MOVES * momentum, RESTS * max(momentum, impulse)) + 1e-14
    assert touched > 100
