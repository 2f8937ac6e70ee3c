"""Accelerometer and gyroscope on a body of a plant; neither has bias or noise."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from sheldrake.common._checked import checked
from sheldrake.common._kernels.vec import add3, cross3
from sheldrake.common.value import AbstractValue
from sheldrake.math import RigidTransform
from sheldrake.systems.framework import LeafSystem, LeafSystem_
from sheldrake.systems.framework._port_getters import input_port, output_port
from sheldrake.systems.framework._templates import SystemTemplate

if TYPE_CHECKING:
    from sheldrake.multibody.plant import MultibodyPlant
    from sheldrake.multibody.tree import BodyIndex, RigidBody
    from sheldrake.systems.framework import Context, DiagramBuilder, InputPort


@checked
class _OnBody(LeafSystem):
    """What both have in common.

    Args:
        body: The body B the sensor is fixed to.
        X_BS: Pose of the sensor's frame S in B.
    """

    _generic = True

    def __init__(self, body: RigidBody, X_BS: RigidTransform):
        super().__init__()
        self._body, self._X_BS = body.index(), RigidTransform(X_BS)
        self._number = int(self._body)
        self._R_BS, self._p_BS = self._X_BS.rotation().matrix(), self._X_BS.translation()

    def _declare(self, name: str) -> InputPort:
        return self.DeclareAbstractInputPort(name, AbstractValue.Make([]))

    def _of_body(self, i: int, context: Context) -> Any:
        """Of input port i, the item of the body."""
        return self.get_input_port(i).Eval(context)[self._number]

    def body_index(self) -> BodyIndex:
        """Index of the body."""
        return self._body

    def pose(self) -> RigidTransform:
        """Pose of the sensor's frame in the body's."""
        return self._X_BS

    get_body_poses_input_port = input_port("body_poses", "Takes the plant's body poses.")
    get_body_velocities_input_port = input_port("body_spatial_velocities", "Takes the plant's spatial velocities.")
    get_measurement_output_port = output_port(0, "The measurement, shape (3,).")


@checked
class Accelerometer(_OnBody):
    """Acceleration of a point of a body without gravity, in the sensor's frame [m/s^2].

    Args:
        body: The body B the sensor is fixed to.
        X_BS: Pose of the sensor's frame S in B.
        gravity_vector: Gravity in the world [m/s^2], shape (3,); zero measures the plain acceleration.
    """

    def __init__(self, body: RigidBody, X_BS: RigidTransform, gravity_vector: Any = (0.0, 0.0, 0.0)):
        super().__init__(body, X_BS)
        self._gravity = np.array(gravity_vector, float).reshape(3)
        for name in ("body_poses", "body_spatial_velocities", "body_spatial_accelerations"):
            self._declare(name)
        self.DeclareVectorOutputPort("measurement", 3, self._calc)

    def gravity_vector(self) -> np.ndarray:
        """Gravity in the world [m/s^2], shape (3,)."""
        return self._gravity.copy()

    get_body_accelerations_input_port = input_port(
        "body_spatial_accelerations", "Takes the plant's spatial accelerations."
    )

    def _calc(self, context: Context, output: Any) -> None:
        R_WB = self._of_body(0, context).rotation().matrix()
        w = tuple(self._of_body(1, context).rotational().tolist())
        A_WB = self._of_body(2, context)
        p_BS_W = tuple((R_WB @ self._p_BS).tolist())
        turning = add3(cross3(tuple(A_WB.rotational().tolist()), p_BS_W), cross3(w, cross3(w, p_BS_W)))
        output.SetFromVector((R_WB @ self._R_BS).T @ (A_WB.translational() + turning - self._gravity))

    @classmethod
    def AddToDiagram(
        cls, body: RigidBody, X_BS: RigidTransform, gravity_vector: Any, plant: MultibodyPlant, builder: DiagramBuilder
    ) -> Accelerometer:
        """Adds one to a diagram and connects it to the plant."""
        sensor = builder.AddSystem(cls(body, X_BS, gravity_vector))
        builder.Connect(plant.get_body_poses_output_port(), sensor.get_body_poses_input_port())
        builder.Connect(plant.get_body_spatial_velocities_output_port(), sensor.get_body_velocities_input_port())
        builder.Connect(plant.get_body_spatial_accelerations_output_port(), sensor.get_body_accelerations_input_port())
        return sensor


@checked
class Gyroscope(_OnBody):
    """Angular velocity of a body in the sensor's frame [rad/s].

    Args:
        body: The body B the sensor is fixed to.
        X_BS: Pose of the sensor's frame S in B.
    """

    def __init__(self, body: RigidBody, X_BS: RigidTransform):
        super().__init__(body, X_BS)
        for name in ("body_poses", "body_spatial_velocities"):
            self._declare(name)
        self.DeclareVectorOutputPort("measurement", 3, self._calc)

    def _calc(self, context: Context, output: Any) -> None:
        w_WB = self._of_body(1, context).rotational()
        output.SetFromVector((self._of_body(0, context).rotation().matrix() @ self._R_BS).T @ w_WB)

    @classmethod
    def AddToDiagram(
        cls, body: RigidBody, X_BS: RigidTransform, plant: MultibodyPlant, builder: DiagramBuilder
    ) -> Gyroscope:
        """Adds one to a diagram and connects it to the plant."""
        sensor = builder.AddSystem(cls(body, X_BS))
        builder.Connect(plant.get_body_poses_output_port(), sensor.get_body_poses_input_port())
        builder.Connect(plant.get_body_spatial_velocities_output_port(), sensor.get_body_velocities_input_port())
        return sensor


Accelerometer_ = SystemTemplate(
    "Accelerometer_", Accelerometer, scope="sheldrake.systems.sensors", own=True, base=LeafSystem_
)
Gyroscope_ = SystemTemplate("Gyroscope_", Gyroscope, scope="sheldrake.systems.sensors", own=True, base=LeafSystem_)
