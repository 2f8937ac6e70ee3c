"""The quadrotor: a rigid body with four rotors."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from sheldrake.common._checked import checked
from sheldrake.common._overloads import Mismatch
from sheldrake.common._scalars import frozen
from sheldrake.geometry import Box, Cylinder
from sheldrake.math import RigidTransform, RollPitchYaw
from sheldrake.systems.framework import LeafSystem, OutputPort

from ._geometry import ExampleGeometry
from ._kernels import plants

if TYPE_CHECKING:
    from numpy.typing import ArrayLike

    from sheldrake.geometry import SceneGraph
    from sheldrake.geometry._ids import FrameId
    from sheldrake.systems.framework import DiagramBuilder
    from sheldrake.systems.framework._engine.memory import RootView


class QuadrotorPlant(LeafSystem):
    """Position, roll-pitch-yaw angles and their rates under the commands of four rotors (Mellinger and Kumar 2011).

    Ports: input "propeller_force" (zero when it is not connected), output "state".

    Args:
        m_arg: Mass [kg].
        L_arg: Distance of a rotor from the centre [m].
        I_arg: Inertia about the centre of mass [kg m^2], shape (3, 3).
        kF_arg: Force of a rotor for one unit of its command.
        kM_arg: Torque of a rotor for one unit of its command.
    """

    _generic = True

    _complex_rows = True

    @checked
    def __init__(
        self,
        m_arg: float = 0.775,
        L_arg: float = 0.15,
        I_arg: ArrayLike | None = None,
        kF_arg: float = 1.0,
        kM_arg: float = 0.0245,
    ):
        super().__init__()
        inertia = np.diag([0.0015, 0.0025, 0.0035]) if I_arg is None else np.array(I_arg, float)
        if inertia.shape != (3, 3):
            raise Mismatch(f"QuadrotorPlant(): incompatible constructor arguments: I_arg has shape {inertia.shape}.")
        self._inertia = np.vstack([inertia, np.linalg.inv(inertia)])
        self._numbers: Any = plants.Quadrotor.view(np.array([m_arg, L_arg, kF_arg, kM_arg, 9.81]))
        self.DeclareVectorInputPort("propeller_force", 4)
        self._inputs[0].optional = True
        self.DeclareStateOutputPort("state", self.DeclareContinuousState(12))
        self.DeclareTimeDerivatives(plants.quadrotor)

    def _kernel_models(self, root: RootView) -> dict:
        return {"inertia_model": self._inertia, "model": self._numbers}

    def m(self) -> float:
        """Mass [kg]."""
        return float(self._numbers.m)

    def g(self) -> float:
        """Gravity [m/s^2]."""
        return float(self._numbers.g)

    def length(self) -> float:
        """Distance of a rotor from the centre [m]."""
        return float(self._numbers.L)

    def force_constant(self) -> float:
        """Force of a rotor for one unit of its command."""
        return float(self._numbers.kF)

    def moment_constant(self) -> float:
        """Torque of a rotor for one unit of its command."""
        return float(self._numbers.kM)

    def inertia(self) -> np.ndarray:
        """Inertia about the centre of mass [kg m^2], shape (3, 3), read-only."""
        return frozen(self._inertia[:3].copy())


@checked
def StabilizingLQRController(quadrotor_plant: QuadrotorPlant, nominal_position: ArrayLike) -> Any:
    """A linear-quadratic regulator that hovers at a position [m], shape (3,); an AffineSystem from state to rotors."""
    from sheldrake.systems.controllers import LinearQuadraticRegulator

    context = quadrotor_plant.CreateDefaultContext()
    context.SetContinuousState(np.append(np.asarray(nominal_position, float).reshape(3), np.zeros(9)))
    hover = quadrotor_plant.m() * quadrotor_plant.g() / 4.0
    quadrotor_plant.get_input_port(0).FixValue(context, np.full(4, hover))
    Q = np.diag(np.repeat([10.0, 1.0], 6))
    return LinearQuadraticRegulator(quadrotor_plant, context, Q, np.eye(4))


@checked
class QuadrotorGeometry(ExampleGeometry):
    """Draws a quadrotor; made by `AddToBuilder`."""

    def __init__(self, scene_graph: SceneGraph):
        super().__init__(scene_graph, "quadrotor", ("state", 12))
        body = self.add_frame("base_link")
        self.draw(body, RigidTransform(), Box(0.08, 0.08, 0.03), "hub", [0.2, 0.2, 0.2, 1])
        arm = QuadrotorPlant().length()
        self.draw(body, RigidTransform(), Box(2 * arm, 0.015, 0.01), "arm_x", [0.4, 0.4, 0.4, 1])
        self.draw(body, RigidTransform(), Box(0.015, 2 * arm, 0.01), "arm_y", [0.4, 0.4, 0.4, 1])
        for i, (x, y) in enumerate(((1, 0), (0, 1), (-1, 0), (0, -1))):
            color = [0.8, 0.2, 0.1, 0.7] if i == 0 else [0.3, 0.5, 0.8, 0.7]  # the first rotor shows the front
            self.draw(body, RigidTransform([x * arm, y * arm, 0.015]), Cylinder(0.07, 0.005), f"rotor{i}", color)

    def get_frame_id(self) -> FrameId:
        """The frame of the body."""
        return self._frames[0]

    def poses(self, state: np.ndarray) -> list[RigidTransform]:
        """The pose of the body."""
        return [RigidTransform(RollPitchYaw(state[3:6]), state[:3])]

    @classmethod
    def AddToBuilder(
        cls, builder: DiagramBuilder, quadrotor_state_port: OutputPort, scene_graph: SceneGraph
    ) -> QuadrotorGeometry:
        """Adds one to a diagram and connects it to the state and the scene graph."""
        return cls(scene_graph)._add(builder, quadrotor_state_port, scene_graph)
