"""A double pendulum: chaotic, and still its energy stays, to the accuracy of the integrator.

Run it: python examples/double_pendulum.py [--headless]
"""

import sys

import numpy as np

from sheldrake.all import (
    AddMultibodyPlantSceneGraph,
    Capsule,
    DiagramBuilder,
    FixedOffsetFrame,
    MeshcatVisualizer,
    RevoluteJoint,
    RigidTransform,
    Simulator,
    SpatialInertia,
    StartMeshcat,
)

MASS, LENGTH = 1.0, 0.5
"""Of each link, a thin rod [kg], [m]."""


def add_link(plant, name, parent_frame, y, color):
    """Hangs a rod on a frame and returns the frame of its other end."""
    p_BoBcm_B = np.array([0.0, 0.0, -LENGTH / 2])
    M_BBo_B = SpatialInertia.ThinRodWithMass(MASS, LENGTH, [0, 0, 1]).Shift(-p_BoBcm_B)
    link = plant.AddRigidBody(name, M_BBo_B)
    X_BG = RigidTransform([0.0, y, -LENGTH / 2])
    plant.RegisterVisualGeometry(link, X_BG, Capsule(0.02, LENGTH), "rod", color)
    plant.AddJoint(RevoluteJoint(f"{name}_joint", parent_frame, link.body_frame(), [0, 1, 0]))
    return plant.AddFrame(FixedOffsetFrame(f"{name}_end", link.body_frame(), RigidTransform([0.0, 0.0, -LENGTH])))


def main(meshcat=None, seconds=5.0, accuracy=1e-8):
    builder = DiagramBuilder()
    plant, scene_graph = AddMultibodyPlantSceneGraph(builder, time_step=0.0)
    elbow = add_link(plant, "upper", plant.world_frame(), 0.0, [0.2, 0.4, 0.7, 1.0])
    add_link(plant, "lower", elbow, 0.045, [0.8, 0.4, 0.2, 1.0])
    plant.Finalize()
    if meshcat is not None:
        MeshcatVisualizer.AddToBuilder(builder, scene_graph, meshcat)
    diagram = builder.Build()

    simulator = Simulator(diagram)
    plant_context = plant.GetMyMutableContextFromRoot(simulator.get_mutable_context())
    plant.SetPositions(plant_context, [2.0, 1.0])
    height = 2 * MASS * 9.81 * 2 * LENGTH  # the scale of the energy [J]: hanging down to standing up

    def energy():
        return plant.EvalKineticEnergy(plant_context) + plant.EvalPotentialEnergy(plant_context)

    before = energy()
    simulator.get_mutable_integrator().set_target_accuracy(accuracy)
    simulator.set_target_realtime_rate(1.0 if meshcat is not None else 0.0)
    simulator.AdvanceTo(seconds)
    drift = (energy() - before) / height
    angles = plant.GetPositions(plant_context)
    print(f"after {seconds:g} s at {np.round(angles, 4)} rad; energy drifted by {drift:.1e} of {height:.2f} J")
    return drift


if __name__ == "__main__":
    main(None if "--headless" in sys.argv else StartMeshcat())
