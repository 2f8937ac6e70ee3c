"""Worlds of one batch with masses, gravity, friction and gains of their own."""

import numpy as np
import pytest

import sheldrake
from sheldrake.geometry import Box, GeometryInstance, HalfSpace, ProximityProperties
from sheldrake.math import RigidTransform
from sheldrake.multibody.math import SpatialInertia
from sheldrake.multibody.parsing import Parser
from sheldrake.multibody.plant import AddMultibodyPlantSceneGraph, CoulombFriction, MultibodyPlant
from sheldrake.multibody.tree import PdControllerGains, PrismaticJoint
from sheldrake.systems.analysis import BatchSimulator, Simulator
from sheldrake.systems.framework import DiagramBuilder
from sheldrake.systems.primitives import ConstantVectorSource


def sliding_block(mu_block, mu_ground, gravity=(0.0, 0.0, -9.81), time_step=1e-3):
    """A block on the ground that slides along x at first."""
    builder = DiagramBuilder()
    plant, scene_graph = AddMultibodyPlantSceneGraph(builder, time_step)
    plant.mutable_gravity_field().set_gravity_vector(gravity)
    block = plant.AddRigidBody("block", SpatialInertia.SolidBoxWithMass(1.0, 0.2, 0.2, 0.1))
    shape = RigidTransform(), Box(0.2, 0.2, 0.1), "box", CoulombFriction(mu_block, mu_block)
    plant.RegisterCollisionGeometry(block, *shape)
    ground = RigidTransform(), HalfSpace(), "ground", CoulombFriction(mu_ground, mu_ground)
    plant.RegisterCollisionGeometry(plant.world_body(), *ground)
    plant.Finalize()
    x0 = np.zeros(13)
    x0[0], x0[6], x0[10] = 1.0, 0.0499, 1.0
    return builder.Build(), plant, scene_graph, x0


def slid(diagram, plant, x0, context=None):
    """State after 0.1 s of sliding, of a simulator alone."""
    simulator = Simulator(diagram, diagram.CreateDefaultContext() if context is None else context)
    plant.SetPositionsAndVelocities(plant.GetMyContextFromRoot(simulator.get_mutable_context()), x0)
    simulator.AdvanceTo(0.1)
    return plant.GetPositionsAndVelocities(plant.GetMyContextFromRoot(simulator.get_context())).copy()


def test_friction_of_worlds_is_that_of_models_made_with_it():
    diagram, plant, _, x0 = sliding_block(0.4, 0.5)
    batch = BatchSimulator(diagram, 4)
    scales = np.array([[1.0, 1.0], [0.5, 1.0], [1.0, 2.0], [0.0, 0.0]])  # of the ground and of the block
    batch.parameters(plant)[:, plant.parameter_columns("friction")] = scales
    batch.states(plant)[:] = x0
    batch.AdvanceTo(0.1)
    for (ground, block), x in zip(scales, batch.states(plant)):
        made, its_plant, _, _ = sliding_block(0.4 * block, 0.5 * ground)
        assert np.array_equal(x, slid(made, its_plant, x0))
    speed = batch.states(plant)[:, 10]
    assert speed[2] < speed[0] < speed[1] < speed[3] == 1.0


@pytest.mark.parametrize("time_step", [0.0, 1e-3])
def test_gravity_of_worlds_is_that_of_models_made_with_it(time_step):
    diagram, plant, _, x0 = sliding_block(0.4, 0.5, time_step=time_step)
    x0[6] = 1.0
    batch = BatchSimulator(diagram, 3)
    added = np.array([[0.0, 0.0, 0.0], [0.0, 0.0, 8.1875], [1.0, -2.0, 9.81]])
    batch.parameters(plant)[:, plant.parameter_columns("gravity")] = added
    batch.states(plant)[:] = x0
    batch.AdvanceTo(0.1)
    for g, x in zip(added, batch.states(plant)):
        made, its_plant, _, _ = sliding_block(0.4, 0.5, np.add(g, [0.0, 0.0, -9.81]), time_step)
        assert np.array_equal(x, slid(made, its_plant, x0))


def test_queries_of_a_world_know_its_gravity():
    diagram, plant, _, _ = sliding_block(0.4, 0.5)
    batch = BatchSimulator(diagram, 2)
    batch.parameters(plant)[1, plant.parameter_columns("gravity")] = [1.0, 0.0, 0.0]
    forces = [plant.CalcGravityGeneralizedForces(plant.GetMyContextFromRoot(batch.context(i))) for i in range(2)]
    np.testing.assert_allclose(forces[1] - forces[0], [0.0, 0.0, 0.0, 1.0, 0.0, 0.0], atol=1e-14)


def servo(p, d):
    """A slider under PD control."""
    builder = DiagramBuilder()
    plant = MultibodyPlant(1e-3)
    body = plant.AddRigidBody("slider", SpatialInertia.SolidBoxWithMass(1.0, 0.1, 0.1, 0.1))
    joint = plant.AddJoint(PrismaticJoint("x", plant.world_frame(), body.body_frame(), [1.0, 0.0, 0.0]))
    plant.AddJointActuator("motor", joint).set_controller_gains(PdControllerGains(p=p, d=d))
    plant.Finalize()
    builder.AddSystem(plant)
    wanted = builder.AddSystem(ConstantVectorSource([0.3, 0.0]))
    builder.Connect(wanted.get_output_port(), plant.get_desired_state_input_port(body.model_instance()))
    return builder.Build(), plant


def test_gains_of_worlds_are_those_of_models_made_with_them():
    diagram, plant = servo(40.0, 3.0)
    batch = BatchSimulator(diagram, 3)
    scales = np.array([[1.0, 1.0], [2.0, 0.5], [0.125, 4.0]])
    columns = plant.parameter_columns("gains")
    assert columns.shape == (1, 2)
    batch.parameters(plant)[:, columns[0]] = scales
    batch.AdvanceTo(0.1)
    for (p, d), x in zip(scales, batch.states(plant)):
        made, its_plant = servo(40.0 * p, 3.0 * d)
        assert np.array_equal(x, slid(made, its_plant, np.zeros(2)))


def test_parameters_stay_at_a_new_beginning_and_clones_have_them():
    diagram, plant, _, x0 = sliding_block(0.4, 0.5)
    batch = BatchSimulator(diagram, 2)
    batch.parameters(plant)[1, plant.parameter_columns("friction")] = 0.25
    runs = []
    for _ in range(2):
        batch.Reset()
        batch.states(plant)[:] = x0
        batch.AdvanceTo(0.1)
        runs.append(batch.states(plant).copy())
    assert np.array_equal(runs[0], runs[1]) and runs[0][1, 10] > runs[0][0, 10]
    batch.Reset()
    assert np.array_equal(slid(diagram, plant, x0, batch.context(1).Clone()), runs[0][1])


def test_masses_of_a_robot_by_one_assignment():
    builder = DiagramBuilder()
    plant, _ = AddMultibodyPlantSceneGraph(builder, 1e-3)
    Parser(plant).AddModels(sheldrake.model_path("quadruped/quadruped.urdf"))
    plant.Finalize()
    batch = BatchSimulator(builder.Build(), 5)
    batch.parameters(plant)[:, plant.parameter_columns("mass")] *= np.linspace(0.8, 1.2, 5)[:, None]
    masses = np.array([plant.CalcTotalMass(plant.GetMyContextFromRoot(batch.context(i))) for i in range(5)])
    np.testing.assert_allclose(masses / masses[2], np.linspace(0.8, 1.2, 5), rtol=1e-12)
    damping = plant.parameter_columns("damping")
    assert damping.shape == (plant.num_velocities(),)


def test_what_is_no_parameter_is_refused():
    diagram, plant, scene_graph, _ = sliding_block(0.4, 0.5)
    with pytest.raises(
        ValueError, match=r"'shape' is not among .*'gravity', 'friction' and 'gains'.* diagram for each"
    ):
        plant.parameter_columns("shape")
    batch = BatchSimulator(diagram, 2)
    instance = GeometryInstance(RigidTransform(), Box(1.0, 1.0, 1.0), "more")
    instance.set_proximity_properties(ProximityProperties())
    frame = plant.GetBodyFrameIdOrThrow(plant.GetBodyByName("block").index())
    context = scene_graph.GetMyMutableContextFromRoot(batch.context(1))
    scene_graph.RegisterGeometry(context, plant.get_source_id(), frame, instance)
    with pytest.raises(RuntimeError, match="World 1 of a batch cannot have geometry"):
        batch.AdvanceTo(0.01)
