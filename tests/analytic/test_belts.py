"""A block on a belt: dragged along with mu g until it is as fast as the belt, then carried."""

from __future__ import annotations

import numpy as np
import pytest

from sheldrake.common.value import AbstractValue
from sheldrake.geometry import (
    AddCompliantHydroelasticProperties,
    AddContactMaterial,
    AddRigidHydroelasticProperties,
    Box,
    ProximityProperties,
)
from sheldrake.math import RigidTransform
from sheldrake.multibody.math import SpatialInertia
from sheldrake.multibody.plant import (
    AddMultibodyPlantSceneGraph,
    ContactModel,
    CoulombFriction,
    DiscreteContactApproximation,
)
from sheldrake.systems.analysis import Simulator
from sheldrake.systems.framework import BusValue, DiagramBuilder

G, MU, SPEED, DT = 9.81, 0.3, 0.5, 1e-3
CAUGHT_UP, SETTLED = SPEED / (MU * G), 0.1
APPROXIMATIONS = "kLagged", "kSimilar", "kSap", "kTamsi"


def material(add_hydroelastic=None):
    properties = ProximityProperties()
    AddContactMaterial(dissipation=10.0, point_stiffness=1e6, friction=CoulombFriction(MU, MU), properties=properties)
    if add_hydroelastic is AddRigidHydroelasticProperties:
        add_hydroelastic(0.5, properties)
    elif add_hydroelastic:
        add_hydroelastic(0.1, 1e7, properties)
    return properties


class Conveyor:
    """A block of 1 kg on a belt that runs along x; the block's surface may run, too, and ports are not sampled then."""

    def __init__(self, time_step=DT, approximation="kLagged", surfaces=False, block_axis=None):
        builder = DiagramBuilder()
        self.plant, _ = AddMultibodyPlantSceneGraph(builder, time_step)
        if time_step:
            self.plant.set_discrete_contact_approximation(getattr(DiscreteContactApproximation, approximation))
        if not surfaces:
            self.plant.set_contact_model(ContactModel.kPoint)
        belt = self.plant.AddRigidBody("belt", SpatialInertia.SolidBoxWithMass(5.0, 4.0, 1.0, 0.2))
        self.plant.WeldFrames(self.plant.world_frame(), belt.body_frame(), RigidTransform([0.0, 0.0, -0.1]))
        block = self.plant.AddRigidBody("block", SpatialInertia.SolidBoxWithMass(1.0, 0.2, 0.2, 0.1))
        rigid, soft = (AddRigidHydroelasticProperties, AddCompliantHydroelasticProperties) if surfaces else (None, None)
        top, base = Box(4.0, 1.0, 0.2), Box(0.2, 0.2, 0.1)
        self.plant.RegisterCollisionGeometry(belt, RigidTransform(), top, "top", material(rigid))
        self.plant.RegisterCollisionGeometry(block, RigidTransform(), base, "block", material(soft))
        self.plant.SetSurfaceVelocityAxis(belt, [0.0, 3.0, 0.0])
        if block_axis is not None:
            self.plant.SetSurfaceVelocityAxis(block, block_axis)
            self.plant.SetUseSampledOutputPorts(False)
        self.plant.Finalize()
        self.block, diagram = block, builder.Build()
        self.simulator = Simulator(diagram)
        self.context = self.plant.GetMyContextFromRoot(self.simulator.get_mutable_context())
        self.plant.SetFreeBodyPose(self.context, block, RigidTransform([-1.0, 0.0, 0.05]))
        self.simulator.AdvanceTo(SETTLED)
        self.run_at(SPEED)

    def run_at(self, speed):
        bus = BusValue()
        bus.Set("DefaultModelInstance::belt", AbstractValue.Make(speed))
        self.plant.get_surface_speeds_input_port().FixValue(self.context, bus)

    def velocity_after(self, time):
        self.simulator.AdvanceTo(time)
        return self.plant.EvalBodySpatialVelocityInWorld(self.context, self.block).translational()

    def displacement(self):
        bus = self.plant.get_surface_displacements_output_port().Eval(self.context)
        return bus.Find("DefaultModelInstance::belt")


@pytest.mark.parametrize("surfaces", [False, True])
@pytest.mark.parametrize("approximation", APPROXIMATIONS)
def test_a_block_is_dragged_with_mu_g_and_then_carried(approximation, surfaces):
    scene = Conveyor(approximation=approximation, surfaces=surfaces)
    half = scene.velocity_after(SETTLED + 0.5 * CAUGHT_UP)
    np.testing.assert_allclose(half[:2], [0.5 * SPEED, 0.0], atol=0.02 * SPEED)  # kSimilar glides, and so it hops
    carried = scene.velocity_after(SETTLED + CAUGHT_UP + 0.5)
    np.testing.assert_allclose(carried, [SPEED, 0.0, 0.0], atol=1e-5)


def test_a_continuous_plant_drags_it_just_so():
    scene = Conveyor(time_step=0.0)
    np.testing.assert_allclose(scene.velocity_after(SETTLED + 0.5 * CAUGHT_UP)[0], 0.5 * SPEED, atol=0.02 * SPEED)
    np.testing.assert_allclose(scene.velocity_after(SETTLED + CAUGHT_UP + 0.2)[0], SPEED, atol=1e-3)


@pytest.mark.parametrize("time_step", [0.0, DT])
def test_a_surface_comes_as_far_as_it_ran(time_step):
    scene = Conveyor(time_step=time_step)
    scene.simulator.AdvanceTo(SETTLED + 0.1 - 0.5 * DT)
    scene.run_at(-2.0 * SPEED)
    scene.simulator.AdvanceTo(SETTLED + 0.15 - 0.5 * DT)
    taken = 0.1 * SPEED - 0.05 * 2.0 * SPEED
    np.testing.assert_allclose(scene.displacement(), taken, atol=1e-9 if time_step else 2e-3 * SPEED)


def test_what_rests_on_a_belt_that_stands_still_stays_at_rest():
    scene = Conveyor()
    scene.run_at(0.0)
    assert np.linalg.norm(scene.velocity_after(0.5)) < 1e-12


def test_a_surface_that_does_not_run_drags_nothing(monkeypatch):
    """The fault that these tests must see: contacts without the velocity of their surfaces."""
    from sheldrake.multibody.plant._step.surface_speeds import SurfaceSpeeds

    monkeypatch.setattr(SurfaceSpeeds, "speeds", lambda self, context: np.zeros(1))
    assert abs(Conveyor().velocity_after(SETTLED + CAUGHT_UP)[0]) < 0.01 * SPEED
