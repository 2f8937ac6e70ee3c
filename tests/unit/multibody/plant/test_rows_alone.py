"""Joint limits and PD motors of plants in which nothing can touch: as where the solver iterates as Drake does."""

from __future__ import annotations

import numpy as np
import pytest

from sheldrake.all import (
    AddMultibodyPlantSceneGraph,
    CoulombFriction,
    DiagramBuilder,
    Parser,
    PdControllerGains,
    RigidTransform,
    Simulator,
    Sphere,
)
from sheldrake.multibody.contact_solvers._kernels.solve import solve, solve_to_rest
from sheldrake.multibody.plant._kernels.step import next_state
from sheldrake.multibody.plant._parts import parts_of

INERTIA = '<inertial><mass value="1"/><inertia ixx="0.013" ixy="0" ixz="0" iyy="0.013" iyz="0" izz="4e-4"/></inertial>'
JOINT = """<joint name="joint {0}" type="revolute"><parent link="link {0}"/><child link="link {1}"/>
  <origin xyz="0 0 {2}"/><axis xyz="0 1 0"/><limit lower="-0.4" upper="0.9" effort="{3}" velocity="100"/></joint>"""
CHAIN = (
    '<robot name="chain"><link name="link 0"/>'
    + "".join(f'<link name="link {i}">{INERTIA}</link>' for i in (1, 2, 3))
    + "".join(JOINT.format(i, i + 1, -0.4 if i else 0.0, 30 if i == 1 else 0) for i in range(3))
    + "</robot>"
)


def a_chain(touching: bool):
    """(its diagram, its plant): three links with limits and a PD motor; `touching` adds two balls that never do."""
    builder = DiagramBuilder()
    plant, scene_graph = AddMultibodyPlantSceneGraph(builder, 1e-3)
    scene_graph.set_default_point_contact_algorithm("single_point")
    (chain,) = Parser(plant).AddModelsFromString(CHAIN, "urdf")
    plant.WeldFrames(plant.world_frame(), plant.GetFrameByName("link 0"))
    for i in range(3):
        plant.GetJointByName(f"joint {i}").set_default_angle(0.3 * (i + 1) - 0.1)
    motor = plant.AddJointActuator("motor", plant.GetJointByName("joint 1"), 30.0)
    motor.set_controller_gains(PdControllerGains(p=20.0, d=1.0))
    if touching:
        for body, p in ((plant.world_body(), [9.0, 0.0, 0.0]), (plant.GetBodyByName("link 3"), [0.0, 0.0, 0.0])):
            plant.RegisterCollisionGeometry(body, RigidTransform(p), Sphere(0.01), "ball", CoulombFriction(1.0, 1.0))
    plant.Finalize()
    builder.ExportInput(plant.get_desired_state_input_port(chain), "desired")
    return builder.Build(), plant


def the_motion(touching: bool) -> np.ndarray:
    """Positions and velocities every 10 ms."""
    diagram, plant = a_chain(touching)
    simulator = Simulator(diagram)
    context = simulator.get_mutable_context()
    diagram.get_input_port(0).FixValue(context, [0.2, 0.0])
    found = []
    for k in range(1, 101):
        simulator.AdvanceTo(0.01 * k)
        found.append(plant.GetPositionsAndVelocities(plant.GetMyContextFromRoot(context)))
    return np.array(found)


def test_a_chain_that_meets_its_limits_moves_as_with_drakes_iterations():
    alone, as_drake = the_motion(False), the_motion(True)
    assert min(np.abs(alone[:, :3] - 0.9).min(), np.abs(alone[:, :3] + 0.4).min()) < 1e-3
    np.testing.assert_allclose(alone, as_drake, rtol=0.0, atol=1e-9)


@pytest.mark.parametrize(("touching", "solver"), [(False, solve_to_rest), (True, solve)])
def test_only_where_something_can_touch_drakes_iterations_are_needed(touching, solver):
    _diagram, plant = a_chain(touching)
    parts = parts_of(plant)
    models = parts.kernel_models.of(True, parts.kernel_models.compiled_geometry())
    assert parts.advance.equations.stages(models)[-2:] == [solver, next_state]
    assert models["solver_model"].ahead == (not touching)
    assert models["solver_model"].relative_tolerance == 1e-6
