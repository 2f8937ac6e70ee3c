"""A pole is kept upright on a cart by a linear-quadratic regulator; what it costs is what Riccati's equation says.

Run it: python examples/cart_pole_lqr.py [--headless]
"""

import sys

import numpy as np
from scipy.integrate import trapezoid

from sheldrake.all import (
    AddMultibodyPlantSceneGraph,
    DiagramBuilder,
    Linearize,
    LinearQuadraticRegulator,
    LogVectorOutput,
    MatrixGain,
    MeshcatVisualizer,
    Parser,
    Simulator,
    StartMeshcat,
)

CART_POLE = """
<mujoco model="cart_pole">
  <worldbody>
    <body name="cart">
      <joint name="slide" type="slide" axis="1 0 0"/>
      <geom type="box" size="0.1 0.06 0.04" mass="2" contype="0" conaffinity="0" rgba="0.2 0.4 0.7 1"/>
      <body name="pole" pos="0 -0.09 0">
        <joint name="hinge" type="hinge" axis="0 1 0"/>
        <geom type="capsule" fromto="0 0 0 0 0 .5" size=".015" mass="0.3" contype="0" conaffinity="0" rgba="1 .5 .2 1"/>
      </body>
    </body>
  </worldbody>
  <actuator><motor joint="slide" gear="1"/></actuator>
</mujoco>
"""
Q, R = np.diag([10.0, 10.0, 1.0, 1.0]), np.array([[0.1]])
"""The cost is the integral of x'Qx + u'Ru; x = (cart [m], pole [rad], and their rates), u the force on the cart [N]."""
START = np.array([0.3, 0.1, 0.0, 0.0])


def regulator(plant):
    """Returns the gain K and the matrix S of the cost to go x'Sx, about the pole standing upright."""
    context = plant.CreateDefaultContext()
    u, x = plant.get_actuation_input_port(), plant.get_state_output_port()
    u.FixValue(context, [0.0])
    linear = Linearize(plant, context, u.get_index(), x.get_index())
    return LinearQuadraticRegulator(linear.A(), linear.B(), Q, R)


def main(meshcat=None, seconds=6.0):
    builder = DiagramBuilder()
    plant, scene_graph = AddMultibodyPlantSceneGraph(builder, time_step=0.0)
    Parser(plant).AddModelsFromString(CART_POLE, "xml")
    plant.Finalize()
    K, S = regulator(plant)
    feedback = builder.AddSystem(MatrixGain(-K))
    builder.Connect(plant.get_state_output_port(), feedback.get_input_port())
    builder.Connect(feedback.get_output_port(), plant.get_actuation_input_port())
    logger = LogVectorOutput(plant.get_state_output_port(), builder, publish_period=1e-3)
    if meshcat is not None:
        MeshcatVisualizer.AddToBuilder(builder, scene_graph, meshcat)
    simulator = Simulator(builder.Build())
    context = simulator.get_mutable_context()
    plant.SetPositionsAndVelocities(plant.GetMyMutableContextFromRoot(context), START)
    simulator.set_target_realtime_rate(1.0 if meshcat is not None else 0.0)
    simulator.AdvanceTo(seconds)

    log = logger.FindLog(context)
    x, u = log.data(), -K @ log.data()
    cost = trapezoid(np.sum(x * (Q @ x), axis=0) + np.sum(u * (R @ u), axis=0), log.sample_times())
    print(f"cost {cost:.4f}; by Riccati's equation {START @ S @ START:.4f}; ends at {np.round(x[:, -1], 4)}")
    return cost / (START @ S @ START)


if __name__ == "__main__":
    main(None if "--headless" in sys.argv else StartMeshcat())
