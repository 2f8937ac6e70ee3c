"""Joints with dry friction: they stick, slide and stop as the textbook says."""

from __future__ import annotations

import numpy as np
import pytest

from sheldrake.multibody.math import SpatialInertia, UnitInertia
from sheldrake.multibody.parsing import Parser
from sheldrake.multibody.plant import DiscreteContactApproximation, MultibodyPlant
from sheldrake.multibody.tree import PrismaticJoint
from sheldrake.systems.analysis import Simulator

G, MASS, FRICTION, DT = 9.81, 2.0, 6.0, 1e-3
APPROXIMATIONS = [getattr(DiscreteContactApproximation, name) for name in ("kLagged", "kSimilar", "kSap")]


def slider(approximation, slope):
    """A slider on a slope [rad] with dry friction."""
    plant = MultibodyPlant(DT)
    plant.set_discrete_contact_approximation(approximation)
    body = plant.AddRigidBody("slider", SpatialInertia(MASS, [0, 0, 0], UnitInertia(0.01, 0.01, 0.01)))
    downhill = [np.cos(slope), 0.0, -np.sin(slope)]
    joint = plant.AddJoint(PrismaticJoint("slide", plant.world_frame(), body.body_frame(), downhill))
    joint.set_dry_friction(FRICTION)
    plant.Finalize()
    return plant, joint, Simulator(plant)


@pytest.mark.parametrize("approximation", APPROXIMATIONS)
def test_it_sticks_on_a_gentle_slope(approximation):
    slope = np.arcsin(0.9 * FRICTION / (MASS * G))
    _, joint, simulator = slider(approximation, slope)
    simulator.AdvanceTo(1.0)
    context = simulator.get_context()
    assert abs(joint.get_translation_rate(context)) < 1e-3 * G * np.sin(slope) * DT
    assert abs(joint.get_translation(context)) < 1e-5


@pytest.mark.parametrize("approximation", APPROXIMATIONS)
def test_it_slides_on_a_steep_slope(approximation):
    slope = np.arcsin(1.7 * FRICTION / (MASS * G))
    _, joint, simulator = slider(approximation, slope)
    simulator.AdvanceTo(1.0)
    expected = G * np.sin(slope) - FRICTION / MASS
    assert joint.get_translation_rate(simulator.get_context()) == pytest.approx(expected, rel=1e-6)


@pytest.mark.parametrize("approximation", APPROXIMATIONS)
def test_what_slides_on_the_level_stops_and_stays(approximation):
    _, joint, simulator = slider(approximation, 0.0)
    context, v0 = simulator.get_mutable_context(), 1.5
    joint.set_translation_rate(context, v0)
    simulator.AdvanceTo(0.3)
    assert joint.get_translation_rate(context) == pytest.approx(v0 - FRICTION / MASS * 0.3, rel=1e-9)
    simulator.AdvanceTo(1.0)
    at = joint.get_translation(context)
    assert at == pytest.approx(v0**2 * MASS / (2 * FRICTION), rel=2e-3)  # of first order in the step
    simulator.AdvanceTo(2.0)
    assert joint.get_translation(context) == pytest.approx(at, abs=1e-9)


URDF = """<robot name="r"><link name="base"/><link name="link"><inertial><mass value="1"/>
<inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial></link>
<joint name="j" type="continuous"><parent link="base"/><child link="link"/><axis xyz="0 0 1"/>
<dynamics damping="0.1" friction="0.7"/></joint></robot>"""


@pytest.mark.parametrize("wanted", [False, True])
def test_urdf_friction_is_taken_on_request_and_warned_of_otherwise(wanted):
    plant, warnings = MultibodyPlant(DT), []
    parser = Parser(plant)
    parser.diagnostic_policy().SetActionForWarnings(lambda detail: warnings.append(str(detail.message)))
    parser.SetUseJointFriction(wanted)
    parser.AddModelsFromString(URDF, "urdf")
    assert plant.GetJointByName("j").dry_friction().tolist() == ([0.7] if wanted else [0.0])
    assert any("SetUseJointFriction" in text for text in warnings) is not wanted


def test_what_cannot_have_it_says_so():
    plant, joint, _ = slider(APPROXIMATIONS[0], 0.1)
    with pytest.raises(RuntimeError, match="Finalize"):
        joint.set_dry_friction(1.0)
    for dt, tamsi in ((0.0, False), (DT, True)):
        plant = MultibodyPlant(dt)
        if tamsi:
            plant.set_discrete_contact_approximation(DiscreteContactApproximation.kTamsi)
        body = plant.AddRigidBody("body", SpatialInertia.SolidSphereWithMass(1.0, 0.1))
        joint = plant.AddJoint(PrismaticJoint("slide", plant.world_frame(), body.body_frame(), [1, 0, 0]))
        with pytest.raises(RuntimeError, match="set_dry_friction"):
            joint.set_dry_friction(-1.0)
        joint.set_dry_friction(0.5)
        with pytest.raises(RuntimeError, match="'slide' has dry friction"):
            plant.Finalize()
