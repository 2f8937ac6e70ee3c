"""Energies and powers of systems."""

from sheldrake.examples import PendulumPlant
from sheldrake.math import RigidTransform
from sheldrake.multibody.plant import MultibodyPlant
from sheldrake.multibody.tree import SpatialInertia
from sheldrake.systems.framework import DiagramBuilder, LeafSystem


def test_a_diagram_has_no_energy_whatever_is_in_it():
    builder = DiagramBuilder()
    pendulum, plant = builder.AddSystem(PendulumPlant()), builder.AddSystem(MultibodyPlant(0.0))
    ball = plant.AddRigidBody("ball", SpatialInertia.SolidSphereWithMass(2.0, 0.1))
    plant.Finalize()
    diagram = builder.Build()
    context = diagram.CreateDefaultContext()
    of_pendulum, of_plant = pendulum.GetMyContextFromRoot(context), plant.GetMyContextFromRoot(context)
    of_pendulum.SetContinuousState([0.3, 1.0])
    plant.SetFreeBodyPose(of_plant, ball, RigidTransform([0.0, 0.0, 3.0]))
    assert pendulum.EvalPotentialEnergy(of_pendulum) < 0.0 < plant.EvalPotentialEnergy(of_plant)
    for call in ("EvalPotentialEnergy", "EvalKineticEnergy", "CalcConservativePower", "CalcNonConservativePower"):
        energy = getattr(diagram, call)(context)
        assert energy == 0.0 and type(energy) is float, call


def test_a_system_of_ones_own_says_its_energy():
    class Spring(LeafSystem):
        def DoCalcPotentialEnergy(self, context):
            return 2

    spring = Spring()
    assert spring.CalcPotentialEnergy(spring.CreateDefaultContext()) == 2.0
