"""Propellers, wings and lists of forces give pydrake's forces."""

import importlib

import numpy as np
import pytest

pytest.importorskip("pydrake")

from random_plants import library, random_pose
from test_plant_against_pydrake import close

pytestmark = pytest.mark.peer


def quadrotor(name):
    """State after 0.05 s of a body with two propellers, a wing and a joint list of forces."""
    lib = library(name)
    analysis = importlib.import_module(f"{name}.systems.analysis")
    primitives = importlib.import_module(f"{name}.systems.primitives")
    rng = np.random.default_rng(4)
    builder = lib.DiagramBuilder()
    plant = builder.AddSystem(lib.MultibodyPlant(1e-3))
    body = plant.AddRigidBody("frame", lib.SpatialInertia.SolidBoxWithMass(0.5, 0.2, 0.3, 0.05))
    plant.Finalize()
    info = [lib.PropellerInfo(body.index(), random_pose(lib, rng), 2.0, 0.3) for _ in range(2)]
    propellers = builder.AddSystem(lib.Propeller(info))
    wing = builder.AddSystem(lib.Wing(body.index(), 0.2, random_pose(lib, rng), 1.1))
    join = builder.AddSystem(lib.ExternallyAppliedSpatialForceMultiplexer(2))
    command = builder.AddSystem(primitives.ConstantVectorSource([0.7, -0.4]))
    wind = builder.AddSystem(primitives.ConstantVectorSource([1.0, 2.0, 3.0]))
    for source, target in (
        (command.get_output_port(), propellers.get_command_input_port()),
        (plant.get_body_poses_output_port(), propellers.get_body_poses_input_port()),
        (plant.get_body_poses_output_port(), wing.get_body_poses_input_port()),
        (plant.get_body_spatial_velocities_output_port(), wing.get_body_spatial_velocities_input_port()),
        (wind.get_output_port(), wing.get_wind_velocity_input_port()),
        (propellers.get_spatial_forces_output_port(), join.get_input_port(0)),
        (wing.get_spatial_force_output_port(), join.get_input_port(1)),
        (join.get_output_port(0), plant.get_applied_spatial_force_input_port()),
    ):
        builder.Connect(source, target)
    diagram = builder.Build()
    simulator = analysis.Simulator(diagram)
    context = plant.GetMyContextFromRoot(simulator.get_mutable_context())
    plant.SetVelocities(context, rng.normal(size=6))
    center = wing.get_aerodynamic_center_output_port().Eval(wing.GetMyContextFromRoot(simulator.get_context()))
    simulator.AdvanceTo(0.05)
    return plant.GetPositionsAndVelocities(context), center


def test_a_flying_body():
    for ours, theirs in zip(quadrotor("sheldrake"), quadrotor("pydrake")):
        close(ours, theirs, tolerance=1e-11)
