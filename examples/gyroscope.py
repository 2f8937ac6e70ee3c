"""A body thrown with a spin about its middle axis turns over and over: Euler's equations without torque.

Its angular velocity is a Jacobi elliptic function of time; its angular momentum stays (Landau and Lifshitz,
"Mechanics", section 37).

Run it: python examples/gyroscope.py [--headless]
"""

import sys

import numpy as np
from scipy.special import ellipk

from sheldrake.all import (
    AddMultibodyPlantSceneGraph,
    Box,
    DiagramBuilder,
    LogVectorOutput,
    MeshcatVisualizer,
    Quaternion,
    RigidTransform,
    RotationMatrix,
    Simulator,
    SpatialInertia,
    SpatialVelocity,
    StartMeshcat,
)

SIDES = (0.3, 0.2, 0.05)
"""Of the box [m]: the moments of inertia about x, y, z grow in that order."""
OMEGA = np.array([0.2, 10.0, 0.2])
"""Where it starts: angular velocity of the body in the world [rad/s], along axes that are then the body's."""


def tumbling_period(M_BBo_B, omega):
    """Returns the period of the angular velocity in the body [s] (Landau and Lifshitz, eq. 37.12)."""
    I1, I2, I3 = moments = M_BBo_B.CalcRotationalInertia().get_moments()
    twice_energy, M2 = moments @ omega**2, (moments * omega) @ (moments * omega)
    if M2 < twice_energy * I2:  # the spin passes closer to the axis of the smallest moment
        I1, I3 = I3, I1
    m = (I2 - I1) * (twice_energy * I3 - M2) / ((I3 - I2) * (M2 - twice_energy * I1))
    return 4.0 * ellipk(m) * np.sqrt(I1 * I2 * I3 / ((I3 - I2) * (M2 - twice_energy * I1)))


def main(meshcat=None, seconds=8.0):
    builder = DiagramBuilder()
    plant, scene_graph = AddMultibodyPlantSceneGraph(builder, time_step=0.0)
    plant.mutable_gravity_field().set_gravity_vector([0.0, 0.0, 0.0])
    body = plant.AddRigidBody("body", SpatialInertia.SolidBoxWithMass(1.0, *SIDES))
    plant.RegisterVisualGeometry(body, RigidTransform(), Box(*SIDES), "body", [0.2, 0.5, 0.8, 1.0])
    plant.Finalize()
    logger = LogVectorOutput(plant.get_state_output_port(), builder, publish_period=0.01)
    if meshcat is not None:
        MeshcatVisualizer.AddToBuilder(builder, scene_graph, meshcat)

    simulator = Simulator(builder.Build())
    context = simulator.get_mutable_context()
    plant_context = plant.GetMyMutableContextFromRoot(context)
    plant.SetFreeBodySpatialVelocity(plant_context, body, SpatialVelocity(OMEGA, np.zeros(3)))
    before = plant.CalcSpatialMomentumInWorldAboutPoint(plant_context, np.zeros(3)).rotational()
    simulator.get_mutable_integrator().set_target_accuracy(1e-9)
    simulator.set_target_realtime_rate(1.0 if meshcat is not None else 0.0)
    simulator.AdvanceTo(seconds)
    after = plant.CalcSpatialMomentumInWorldAboutPoint(plant_context, np.zeros(3)).rotational()
    drift = np.linalg.norm(after - before) / np.linalg.norm(before)

    log = logger.FindLog(context)
    times, states = log.sample_times(), log.data().T
    R_BW = [RotationMatrix(Quaternion(q / np.linalg.norm(q))).inverse() for q in states[:, :4]]
    spin = np.array([R @ w_WB for R, w_WB in zip(R_BW, states[:, 7:10])])[:, 1]  # about the middle axis
    up = np.flatnonzero((spin[:-1] < 0) & (spin[1:] >= 0))
    crossings = times[up] - spin[up] * (times[up + 1] - times[up]) / (spin[up + 1] - spin[up])
    period, expected = np.diff(crossings).mean(), tumbling_period(body.default_spatial_inertia(), OMEGA)
    print(f"tumbles every {period:.4f} s; by the elliptic integral {expected:.4f} s; momentum drifts by {drift:.1e}")
    return period / expected, drift


if __name__ == "__main__":
    main(None if "--headless" in sys.argv else StartMeshcat())
