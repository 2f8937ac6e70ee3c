"""The rimless wheel: spokes without a rim roll down a slope."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from sheldrake.common._kernels.generic import cos, sin
from sheldrake.common._overloads import overloaded
from sheldrake.common.value import AbstractValue
from sheldrake.geometry import Box, Cylinder, SceneGraph
from sheldrake.math import RigidTransform, RollPitchYaw, RotationMatrix
from sheldrake.systems.framework import (
    BasicVector,
    Context,
    ContinuousState,
    DiagramBuilder,
    LeafSystem,
    OutputPort,
    State,
    UnrestrictedUpdateEvent,
    WitnessFunctionDirection,
)
from sheldrake.systems.framework._declarations import Callback, PythonStage, Stages
from sheldrake.systems.framework._index import Ticket
from sheldrake.systems.framework._port_getters import output_port

from ._geometry import ExampleGeometry, drawn_in_scene
from ._kernels import plants
from ._named_vector import NamedVector

if TYPE_CHECKING:
    from sheldrake.systems.framework._engine.memory import RootView


class RimlessWheelContinuousState(NamedVector):
    """Angle of the stance spoke from the vertical [rad], clockwise, and its rate [rad/s]."""

    elements = {"theta": 0.0, "thetadot": 0.0}


class RimlessWheelParams(NamedVector):
    """Mass [kg], length of a spoke [m], gravity [m/s^2], number of spokes, slope [rad]."""

    elements = {"mass": 1.0, "length": 1.0, "gravity": 9.81, "number_of_spokes": 8.0, "slope": 0.08}


class RimlessWheel(LeafSystem):
    """An inverted pendulum whose spoke is replaced by the next at each inelastic step (McGeer 1990).

    Ports: outputs "y0", the angle and its rate, and "y1", position, roll-pitch-yaw and their rates. The discrete state
    is the place of the stance toe along the slope [m]; the abstract state tells whether the wheel stands on two spokes.
    """

    _generic = True
    _symbolic = False

    STANDING_RATE = 1e-2
    """Slower than this at a step [rad/s], the wheel stays on two spokes."""

    def __init__(self) -> None:
        super().__init__()
        stance = self.DeclareContinuousState(RimlessWheelContinuousState(), 1, 1, 0)
        self.DeclareDiscreteState(1)
        self.DeclareAbstractState(AbstractValue.Make(False))
        state, parameters = self.all_state_ticket(), self.all_parameters_ticket()
        self.DeclareStateOutputPort("y0", stance)
        self.DeclareVectorOutputPort("y1", 12, self._calc_floating_base, {state, parameters})
        self.DeclareNumericParameter(RimlessWheelParams())
        self.DeclareTimeDerivatives(Stages(_derivatives))
        self._declare_scratch(_Scratch(plants.Stance(np.zeros(1))))
        falling = WitnessFunctionDirection.kPositiveThenNonPositive
        for name, guard, step in (
            ("step backward", plants.wheel_until_step_backward, self._step_backward),
            ("step forward", plants.wheel_until_step_forward, self._step_forward),
        ):
            self._declare_witness(name, falling, guard, UnrestrictedUpdateEvent(step))

    def DoCalcTimeDerivatives(self, context: Context, derivatives: ContinuousState) -> None:
        """theta'' = g / l sin(theta); nothing moves on two spokes. On doubles a kernel does this."""
        if context.get_abstract_state(0).get_value():
            derivatives.SetFromVector([0.0, 0.0])
            return
        theta, rate = context.get_continuous_state_vector()._v.tolist()
        _, length, gravity, _, _ = context.get_numeric_parameter(0)._v.tolist()
        derivatives.SetFromVector([rate, sin(theta) * gravity / length])

    @staticmethod
    def calc_alpha(params: RimlessWheelParams) -> float:
        """Half the angle between two spokes [rad]."""
        return math.pi / params.number_of_spokes()

    get_minimal_state_output_port = output_port(0, "The port of the angle and its rate.")
    get_floating_base_state_output_port = output_port(1, "The port of the state as of a floating body.")

    @staticmethod
    def _state(context: Context) -> RimlessWheelContinuousState:
        return RimlessWheelContinuousState.of(context.get_continuous_state_vector())

    @staticmethod
    def _params(context: Context) -> RimlessWheelParams:
        return RimlessWheelParams.of(context.get_numeric_parameter(0))

    @staticmethod
    def _calc_floating_base(context: Context, output: BasicVector) -> None:
        """The pitch counts whole turns: between two spokes the toe moves by 2 l sin(alpha), the wheel by 2 alpha."""
        p, toe = RimlessWheel._params(context), context.get_discrete_state(0)[0]
        theta, rate = context.get_continuous_state_vector()._v
        l, slope = p.length(), p.slope()
        position = [toe * cos(slope) + l * sin(theta), 0.0, -toe * sin(slope) + l * cos(theta)]
        velocity = [rate * l * cos(theta), 0.0, -rate * l * sin(theta)]
        alpha = RimlessWheel.calc_alpha(p)
        pitch = theta + toe * alpha / (l * sin(alpha))
        output.SetFromVector([*position, 0.0, pitch, 0.0, *velocity, 0.0, rate, 0.0])

    def _step_forward(self, context: Context, event: UnrestrictedUpdateEvent, state: State) -> None:
        self._step(context, state, 1.0)

    def _step_backward(self, context: Context, event: UnrestrictedUpdateEvent, state: State) -> None:
        self._step(context, state, -1.0)

    def _step(self, context: Context, state: State, direction: float) -> None:
        """The next spoke takes over with the angular momentum about its toe."""
        p, x = self._params(context), self._state(context)
        alpha = self.calc_alpha(p)
        rate = x.thetadot() * cos(2.0 * alpha)
        theta = p.slope() - direction * alpha
        standing = bool(abs(rate) < self.STANDING_RATE)
        state.get_mutable_continuous_state().SetFromVector([theta, 0.0 if standing else rate])
        toe = context.get_discrete_state(0)[0] + direction * 2.0 * p.length() * sin(alpha)
        state.get_mutable_discrete_state().get_mutable_vector(0).SetAtIndex(0, toe)
        state.get_mutable_abstract_state().get_mutable_value(0).set_value(standing)


class _Scratch(NamedTuple):
    """What kernels read of the abstract state."""

    stance: plants.Stance


def _find_stance(wheel: RimlessWheel, context: Context) -> None:
    scratch = context._store.scratch(context._node)
    scratch.stance.on_two[0] = context.get_abstract_state(0).get_value()


_STAGES = [PythonStage(_find_stance, ("stance", "on_two"), frozenset({Ticket.XA})), plants.rimless_wheel]
_CALLBACK = [Callback(RimlessWheel.DoCalcTimeDerivatives, True)]


def _derivatives(wheel: RimlessWheel, root: RootView) -> list[Any]:
    return _STAGES if wheel._scalar is float else _CALLBACK


class RimlessWheelGeometry(ExampleGeometry):
    """Draws a rimless wheel on its slope; made by `AddToBuilder`."""

    def __init__(self, params: RimlessWheelParams, scene_graph: SceneGraph):
        super().__init__(scene_graph, None, ("floating_base_state", 12))
        slope = RigidTransform(RotationMatrix.MakeYRotation(params.slope()), [0.0, 0.0, 0.0])
        sand = [0.9297, 0.7930, 0.6758, 1]
        self.draw(None, slope @ RigidTransform([0, 0, -5]), Box(100, 1, 10), "ramp", sand)
        wheel = self.add_frame("center")
        about_y = RigidTransform(RotationMatrix.MakeXRotation(math.pi / 2), [0.0, 0.0, 0.0])
        self.draw(wheel, about_y, Cylinder(0.2, 0.2), "hub", [0.6, 0.2, 0.2, 1])
        length, number = params.length(), int(params.number_of_spokes())
        for i in range(number):
            turn = RigidTransform(RotationMatrix.MakeYRotation(2 * math.pi * i / number), [0.0, 0.0, 0.0])
            down = RigidTransform([0, 0, -length / 2])
            self.draw(wheel, turn @ down, Cylinder(0.0075, length), f"spoke{i}", [0, 0, 0, 1])

    def poses(self, state: np.ndarray) -> list[RigidTransform]:
        """The pose of the wheel."""
        return [RigidTransform(RollPitchYaw(state[3:6]), state[:3])]

    @classmethod
    @overloaded(*drawn_in_scene("floating_base_state_port", "rimless_wheel_params", RimlessWheelParams))
    def AddToBuilder(
        cls, builder: DiagramBuilder, state_port: OutputPort, params: RimlessWheelParams, scene_graph: SceneGraph
    ) -> RimlessWheelGeometry:
        """Adds one to a diagram: `(builder, floating_base_state_port, [rimless_wheel_params,] scene_graph)`."""
        return cls(params, scene_graph)._add(builder, state_port, scene_graph)
