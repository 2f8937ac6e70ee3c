"""An arm under computed torque: each joint's error dies out like a critically damped spring, whatever the others do.

The controller computes the torque that gives the acceleration kp e + kd de/dt, gravity and Coriolis terms included
("inverse dynamics"), so that e'' + kd e' + kp e = 0. With kd = 2 sqrt(kp) = 2 w: e(t) = e(0) (1 + w t) exp(-w t).

Run it: python examples/arm_pid.py [--headless]
"""

import sys

import numpy as np

from sheldrake.all import (
    AddMultibodyPlantSceneGraph,
    ConstantVectorSource,
    DiagramBuilder,
    InverseDynamicsController,
    LogVectorOutput,
    MeshcatVisualizer,
    Parser,
    Simulator,
    StartMeshcat,
)

AXES = ("z", "y", "y", "x", "y", "x")
LENGTHS = (0.15, 0.35, 0.3, 0.1, 0.1, 0.06)
"""Of six capsules [m], each turning about an axis at its foot."""
W = 4.0
"""Natural frequency of the error [rad/s]."""
GOAL = np.array([0.8, 0.6, 1.1, -0.5, 0.7, 0.3])


def arm():
    """Returns the arm as MJCF: a chain of capsules, hinges, and motors."""
    unit = {"x": "1 0 0", "y": "0 1 0", "z": "0 0 1"}
    text, foot = "", 0.0
    for i, (axis, length) in enumerate(zip(AXES, LENGTHS)):
        shade = 0.3 + 0.1 * i
        text += (
            f'<body name="link{i}" pos="0 0 {foot}"><joint name="joint{i}" type="hinge" axis="{unit[axis]}"/>'
            f'<geom type="capsule" fromto="0 0 0 0 0 {length}" size="{0.05 - 0.005 * i}" density="1200" '
            f'contype="0" conaffinity="0" rgba="{shade} 0.45 {1 - shade} 1"/>'
        )
        foot = length
    motors = "".join(f'<motor joint="joint{i}"/>' for i in range(len(AXES)))
    bodies = f"<worldbody>{text}{'</body>' * len(AXES)}</worldbody>"
    return f"<mujoco model='arm'>{bodies}<actuator>{motors}</actuator></mujoco>"


def main(meshcat=None, seconds=2.0):
    builder = DiagramBuilder()
    plant, scene_graph = AddMultibodyPlantSceneGraph(builder, time_step=0.0)
    Parser(plant).AddModelsFromString(arm(), "xml")
    plant.Finalize()
    n = plant.num_positions()
    gains = np.full(n, W**2), np.zeros(n), np.full(n, 2.0 * W)  # P, I, D
    controller = builder.AddSystem(InverseDynamicsController(plant, *gains, has_reference_acceleration=False))
    goal = builder.AddSystem(ConstantVectorSource(np.concatenate([GOAL, np.zeros(n)])))
    builder.Connect(goal.get_output_port(), controller.get_input_port_desired_state())
    builder.Connect(plant.get_state_output_port(), controller.get_input_port_estimated_state())
    builder.Connect(controller.get_output_port_control(), plant.get_actuation_input_port())
    logger = LogVectorOutput(plant.get_state_output_port(), builder, publish_period=0.01)
    if meshcat is not None:
        MeshcatVisualizer.AddToBuilder(builder, scene_graph, meshcat)
    simulator = Simulator(builder.Build())
    simulator.get_mutable_integrator().set_target_accuracy(1e-6)
    simulator.set_target_realtime_rate(1.0 if meshcat is not None else 0.0)
    simulator.AdvanceTo(seconds)

    log = logger.FindLog(simulator.get_context())
    t, error = log.sample_times(), GOAL[:, None] - log.data()[:n]
    off = abs(error - GOAL[:, None] * (1.0 + W * t) * np.exp(-W * t)).max()
    print(f"{abs(error[:, -1]).max():.4f} rad from the goal; off the critically damped path by {off:.1e} rad")
    return off


if __name__ == "__main__":
    main(None if "--headless" in sys.argv else StartMeshcat())
