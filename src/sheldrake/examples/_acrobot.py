"""The acrobot: a double pendulum with a motor at the elbow only."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import numpy as np

from sheldrake.common._checked import checked
from sheldrake.common._overloads import overloaded
from sheldrake.geometry import Box, Cylinder, SceneGraph
from sheldrake.math import RigidTransform, RotationMatrix
from sheldrake.systems.framework import Context, Diagram, DiagramBuilder, LeafSystem, OutputPort

from ._energy import energy_of
from ._geometry import ExampleGeometry, drawn_in_scene
from ._kernels import plants
from ._named_vector import NamedVector

if TYPE_CHECKING:
    from sheldrake.common._types import Scalar
    from sheldrake.systems.framework._engine.memory import RootView


class AcrobotInput(NamedVector):
    """Torque at the elbow [N m]."""

    elements = {"tau": 0.0}


class AcrobotState(NamedVector):
    """Angle of the upper link from hanging down, of the lower from the upper [rad], and their rates [rad/s]."""

    elements = {"theta1": 0.0, "theta2": 0.0, "theta1dot": 0.0, "theta2dot": 0.0}


class AcrobotParams(NamedVector):
    """Masses [kg], lengths, distances of the centres of mass from the joints [m], inertias about them, damping."""

    elements = {
        **{"m1": 1.0, "m2": 1.0, "l1": 1.0, "l2": 2.0, "lc1": 0.5, "lc2": 1.0},
        **{"Ic1": 0.083, "Ic2": 0.33, "b1": 0.1, "b2": 0.1, "gravity": 9.81},
    }


class SpongControllerParams(NamedVector):
    """Gains of the swing-up (energy, position, rate) and the cost below which the regulator takes over."""

    elements = {"k_e": 5.0, "k_p": 50.0, "k_d": 5.0, "balancing_threshold": 1e3}


@checked
class AcrobotPlant(LeafSystem):
    """M(q) q'' + bias(q, q') = (0, tau).

    Ports: input "elbow_torque" (zero when it is not connected), output "acrobot_state".
    """

    _generic = True

    _complex_rows = True

    def __init__(self) -> None:
        super().__init__()
        self.DeclareNumericParameter(AcrobotParams())
        self.DeclareVectorInputPort("elbow_torque", AcrobotInput())
        self._inputs[0].optional = True
        self.DeclareStateOutputPort("acrobot_state", self.DeclareContinuousState(AcrobotState(), 2, 2, 0))
        self.DeclareTimeDerivatives(plants.acrobot)

    @staticmethod
    def SetMitAcrobotParameters(parameters: AcrobotParams) -> None:
        """Sets what was identified on the acrobot in MIT's laboratory."""
        values = {"m1": 2.4367, "m2": 0.6178, "l1": 0.2563, "lc1": 1.6738, "lc2": 1.5651}
        values |= {"Ic1": -4.7443, "Ic2": -1.0068, "b1": 0.0320, "b2": 0.0413}
        for name, value in values.items():
            getattr(parameters, f"set_{name}")(value)

    def _numbers(self, context: Context) -> Any:
        return plants.Acrobot.view(self.get_parameters(context)._v)

    def MassMatrix(self, context: Context) -> np.ndarray:
        """M(q), shape (2, 2)."""
        m11, m12, m22 = plants.acrobot_mass(self._numbers(context), self.get_state(context)[1])
        return np.array([[m11, m12], [m12, m22]])

    def DynamicsBiasTerm(self, context: Context) -> np.ndarray:
        """Coriolis, gravity and damping, shape (2,)."""
        return np.array(plants.acrobot_bias(self._numbers(context), *self.get_state(context)._v))

    def DoCalcKineticEnergy(self, context: Context) -> Scalar:
        """Kinetic energy [J]."""
        return energy_of(context, plants.acrobot_kinetic_energy)

    def DoCalcPotentialEnergy(self, context: Context) -> Scalar:
        """Potential energy [J], zero at the height of the shoulder."""
        return energy_of(context, plants.acrobot_potential_energy)

    @staticmethod
    def get_state(context: Context) -> AcrobotState:
        """The state in a context."""
        return AcrobotState.of(context.get_continuous_state_vector())

    @staticmethod
    def get_mutable_state(context: Context) -> AcrobotState:
        """The state in a context, to be changed."""
        return AcrobotState.of(context.get_mutable_continuous_state_vector())

    def get_parameters(self, context: Context) -> AcrobotParams:
        """The parameters in a context."""
        return AcrobotParams.of(context.get_numeric_parameter(0))

    def get_mutable_parameters(self, context: Context) -> AcrobotParams:
        """The parameters in a context, to be changed."""
        return AcrobotParams.of(context.get_mutable_numeric_parameter(0))


@checked
class AcrobotSpongController(LeafSystem):
    """Swings the acrobot up by shaping its energy and balances it (Spong, Swing up control of the acrobot, 1994).

    Ports: input "acrobot_state", output "elbow_torque", at most 20 N m.
    """

    _symbolic = False

    def __init__(self) -> None:
        from sheldrake.systems.controllers import LinearQuadraticRegulator
        from sheldrake.systems.primitives import Linearize

        super().__init__()
        self.DeclareVectorInputPort("acrobot_state", AcrobotState())
        self.DeclareVectorOutputPort("elbow_torque", AcrobotInput(), plants.spong)
        self.DeclareNumericParameter(SpongControllerParams())
        plant = AcrobotPlant()
        context = plant.CreateDefaultContext()
        context.SetContinuousState([math.pi, 0.0, 0.0, 0.0])
        plant.get_input_port(0).FixValue(context, [0.0])
        linear = Linearize(plant, context)
        K, S = LinearQuadraticRegulator(linear.A(), linear.B(), np.diag([10.0, 10, 1, 1]), np.eye(1))
        self._models = {"acrobot_model": plants.Acrobot.view(AcrobotParams()._v), "regulator_model": np.vstack([S, K])}

    def _kernel_models(self, root: RootView) -> dict:
        return self._models

    def get_parameters(self, context: Context) -> SpongControllerParams:
        """The gains in a context."""
        return SpongControllerParams.of(context.get_numeric_parameter(0))

    def get_mutable_parameters(self, context: Context) -> SpongControllerParams:
        """The gains in a context, to be changed."""
        return SpongControllerParams.of(context.get_mutable_numeric_parameter(0))


class AcrobotWEncoder(Diagram):
    """The acrobot with encoders at its joints.

    Args:
        acrobot_state_as_second_output: Whether there is an output port of the state too.
    """

    def __init__(self, acrobot_state_as_second_output: bool = False):
        from sheldrake.systems.sensors import RotaryEncoders

        super().__init__()
        builder = DiagramBuilder()
        self._plant: Any = builder.AddNamedSystem("acrobot_plant", AcrobotPlant())
        encoders = builder.AddNamedSystem("encoders", RotaryEncoders(4, [0, 1]))
        builder.Connect(self._plant.get_output_port(0), encoders.get_input_port())
        builder.ExportInput(self._plant.get_input_port(0), "elbow_torque")
        builder.ExportOutput(encoders.get_output_port(), "measured_joint_positions")
        if acrobot_state_as_second_output:
            builder.ExportOutput(self._plant.get_output_port(0), "acrobot_state")
        builder.BuildInto(self)

    def acrobot_plant(self) -> AcrobotPlant:
        """The plant inside."""
        return self._plant

    def get_mutable_acrobot_state(self, context: Context) -> AcrobotState:
        """The state of the plant inside, to be changed."""
        return AcrobotPlant.get_mutable_state(self.GetMutableSubsystemContext(self._plant, context))


class AcrobotGeometry(ExampleGeometry):
    """Draws an acrobot; made by `AddToBuilder`."""

    def __init__(self, params: AcrobotParams, scene_graph: SceneGraph):
        super().__init__(scene_graph, "acrobot", ("state", 4))
        l1, l2 = params.l1(), params.l2()
        self._l1 = l1
        self.draw(None, RigidTransform(), Box(0.2, 0.2, 0.2), "base", [0, 1, 0, 1])
        upper, lower = self.add_frame("upper_link"), self.add_frame("lower_link")
        self.draw(upper, RigidTransform([0, 0.15, -l1 / 2]), Cylinder(0.05, l1), "upper_link", [1, 0, 0, 1])
        self.draw(lower, RigidTransform([0, 0.25, -l2 / 2]), Cylinder(0.05, l2), "lower_link", [0, 0, 1, 1])

    def poses(self, state: np.ndarray) -> list[RigidTransform]:
        """The poses of the two links."""
        elbow = [-self._l1 * math.sin(state[0]), 0.0, -self._l1 * math.cos(state[0])]
        return [
            RigidTransform(RotationMatrix.MakeYRotation(state[0])),
            RigidTransform(RotationMatrix.MakeYRotation(state[0] + state[1]), elbow),
        ]

    @classmethod
    @overloaded(*drawn_in_scene("acrobot_state_port", "acrobot_params", AcrobotParams))
    def AddToBuilder(
        cls, builder: DiagramBuilder, state_port: OutputPort, params: AcrobotParams, scene_graph: SceneGraph
    ) -> AcrobotGeometry:
        """Adds one to a diagram: `(builder, acrobot_state_port, [acrobot_params,] scene_graph)`."""
        return cls(params, scene_graph)._add(builder, state_port, scene_graph)
