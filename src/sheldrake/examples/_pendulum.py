"""The pendulum: a point mass on a massless rod."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from sheldrake.common._checked import checked
from sheldrake.geometry import Box, Cylinder, SceneGraph, Sphere
from sheldrake.math import RigidTransform, RotationMatrix
from sheldrake.systems.framework import Context, DiagramBuilder, LeafSystem, OutputPort
from sheldrake.systems.framework._port_getters import output_port

from ._energy import energy_of
from ._geometry import ExampleGeometry
from ._kernels import plants
from ._named_vector import NamedVector

if TYPE_CHECKING:
    from sheldrake.common._types import Scalar
    from sheldrake.systems.framework import Context


class PendulumInput(NamedVector):
    """Torque at the pivot [N m]."""

    elements = {"tau": 0.0}


class PendulumState(NamedVector):
    """Angle from hanging straight down [rad] and its rate [rad/s]."""

    elements = {"theta": 0.0, "thetadot": 0.0}


class PendulumParams(NamedVector):
    """Mass [kg], length [m], damping [N m s/rad], gravity [m/s^2]."""

    elements = {"mass": 1.0, "length": 0.5, "damping": 0.1, "gravity": 9.81}


class PendulumPlant(LeafSystem):
    """m l^2 theta'' + b theta' + m g l sin(theta) = tau.

    Ports: input "tau" (zero when it is not connected), output "state".
    """

    _generic = True

    _complex_rows = True

    def __init__(self) -> None:
        super().__init__()
        self.DeclareNumericParameter(PendulumParams())
        self.DeclareVectorInputPort("tau", PendulumInput())
        self._inputs[0].optional = True
        self.DeclareStateOutputPort("state", self.DeclareContinuousState(PendulumState(), 1, 1, 0))
        self.DeclareTimeDerivatives(plants.pendulum)

    def DoCalcKineticEnergy(self, context: Context) -> Scalar:
        """Kinetic energy [J]."""
        return energy_of(context, plants.pendulum_kinetic_energy)

    def DoCalcPotentialEnergy(self, context: Context) -> Scalar:
        """Potential energy [J], zero at the height of the pivot."""
        return energy_of(context, plants.pendulum_potential_energy)

    get_state_output_port = output_port(0, "The port of the state.")

    @staticmethod
    @checked
    def get_state(context: Context) -> PendulumState:
        """The state in a context."""
        return PendulumState.of(context.get_continuous_state_vector())

    @staticmethod
    @checked
    def get_mutable_state(context: Context) -> PendulumState:
        """The state in a context, to be changed."""
        return PendulumState.of(context.get_mutable_continuous_state_vector())

    @checked
    def get_parameters(self, context: Context) -> PendulumParams:
        """The parameters in a context."""
        return PendulumParams.of(context.get_numeric_parameter(0))

    @checked
    def get_mutable_parameters(self, context: Context) -> PendulumParams:
        """The parameters in a context, to be changed."""
        return PendulumParams.of(context.get_mutable_numeric_parameter(0))


@checked
class PendulumGeometry(ExampleGeometry):
    """Draws a pendulum of the default parameters; made by `AddToBuilder`."""

    def __init__(self, scene_graph: SceneGraph):
        super().__init__(scene_graph, "pendulum", ("state", 2))
        length, mass = PendulumParams().length(), PendulumParams().mass()
        arm = self.add_frame("arm")
        self.draw(None, RigidTransform([0, 0, 0.025]), Box(0.05, 0.05, 0.05), "base", [0.3, 0.6, 0.4, 1])
        self.draw(arm, RigidTransform([0, 0, -length / 2]), Cylinder(0.01, length), "arm", [0.9, 0.1, 0, 1])
        self.draw(arm, RigidTransform([0, 0, -length]), Sphere(mass / 40), "arm point mass", [0, 0, 1, 1])

    def poses(self, state: np.ndarray) -> list[RigidTransform]:
        """The pose of the arm."""
        return [RigidTransform(RotationMatrix.MakeYRotation(state[0]))]

    @classmethod
    def AddToBuilder(
        cls, builder: DiagramBuilder, pendulum_state_port: OutputPort, scene_graph: SceneGraph
    ) -> PendulumGeometry:
        """Adds one to a diagram and connects it to the state and the scene graph."""
        return cls(scene_graph)._add(builder, pendulum_state_port, scene_graph)
