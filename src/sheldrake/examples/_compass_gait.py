"""The compass gait: two legs without knees walk down a slope."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from sheldrake.common._kernels.generic import cos, sin
from sheldrake.common._overloads import overloaded
from sheldrake.common.value import AbstractValue
from sheldrake.geometry import Box, Cylinder, SceneGraph, Sphere
from sheldrake.math import RigidTransform, RollPitchYaw, RotationMatrix
from sheldrake.systems.framework import (
    BasicVector,
    Context,
    DiagramBuilder,
    LeafSystem,
    OutputPort,
    State,
    UnrestrictedUpdateEvent,
    WitnessFunctionDirection,
)
from sheldrake.systems.framework._port_getters import output_port

from ._geometry import ExampleGeometry, drawn_in_scene
from ._kernels import plants
from ._named_vector import NamedVector

if TYPE_CHECKING:
    from sheldrake.common._types import Scalar


class CompassGaitContinuousState(NamedVector):
    """Angles of the legs from the vertical [rad], clockwise, and their rates [rad/s]."""

    elements = {"stance": 0.0, "swing": 0.0, "stancedot": 0.0, "swingdot": 0.0}


class CompassGaitParams(NamedVector):
    """Masses [kg], length of a leg and distance of its mass from the hip [m], gravity [m/s^2], slope [rad]."""

    elements = {
        **{"mass_hip": 10.0, "mass_leg": 5.0, "length_leg": 1.0, "center_of_mass_leg": 0.5},
        **{"gravity": 9.81, "slope": 0.0525},
    }


class CompassGait(LeafSystem):
    """Two legs, the swing leg replacing the stance leg at each inelastic step (Goswami et al. 1996).

    Ports: input "hip_torque" (zero when it is not connected), outputs "minimal_state" and "floating_base_state", of
    which the last is position, roll-pitch-yaw, hip angle, and their rates. The discrete state is the place of the
    stance toe along the slope [m]; the abstract state tells whether the left leg stands.
    """

    _generic = True

    _complex_rows = True

    def __init__(self) -> None:
        super().__init__()
        legs = self.DeclareContinuousState(CompassGaitContinuousState(), 2, 2, 0)
        self.DeclareDiscreteState(1)
        self.DeclareAbstractState(AbstractValue.Make(True))
        self.DeclareVectorInputPort("hip_torque", 1)
        self._inputs[0].optional = True
        state, parameters = self.all_state_ticket(), self.all_parameters_ticket()
        self.DeclareStateOutputPort("minimal_state", legs)
        self.DeclareVectorOutputPort("floating_base_state", 14, self._calc_floating_base, {state, parameters})
        self.DeclareNumericParameter(CompassGaitParams())
        self.DeclareTimeDerivatives(plants.compass_gait)
        self._declare_witness(
            "foot collision",
            WitnessFunctionDirection.kPositiveThenNonPositive,
            plants.height_of_swing_foot,
            UnrestrictedUpdateEvent(self._collide),
        )

    get_minimal_state_output_port = output_port(0, "The port of the legs' angles and rates.")
    get_floating_base_state_output_port = output_port(1, "The port of the state as of a floating body.")

    def DoCalcKineticEnergy(self, context: Context) -> Scalar:
        """Kinetic energy [J]."""
        mh, m, l, b, *_ = context.get_numeric_parameter(0)._v
        stance, swing, v, w = context.get_continuous_state_vector()._v
        a = l - b
        hip, legs = 0.5 * mh * (l * v) ** 2, 0.5 * m * ((a * v) ** 2 + (l * v) ** 2 + (b * w) ** 2)
        return hip + legs - m * l * b * v * w * cos(swing - stance)

    def DoCalcPotentialEnergy(self, context: Context) -> Scalar:
        """Potential energy [J], zero at the top of the slope."""
        mh, m, l, b, g, slope = context.get_numeric_parameter(0)._v
        stance, swing, *_ = context.get_continuous_state_vector()._v
        toe = -context.get_discrete_state(0)[0] * sin(slope)
        hip = toe + l * cos(stance)
        return g * (m * (toe + (l - b) * cos(stance)) + mh * hip + m * (hip - b * cos(swing)))

    @staticmethod
    def _calc_floating_base(context: Context, output: BasicVector) -> None:
        p, toe = CompassGaitParams.of(context.get_numeric_parameter(0)), context.get_discrete_state(0)[0]
        stance, swing, v, w = context.get_continuous_state_vector()._v
        l, slope = p.length_leg(), p.slope()
        left, right, vl, vr = stance, swing, v, w
        if not context.get_abstract_state(0).get_value():
            left, right, vl, vr = swing, stance, w, v
        position = [toe * cos(slope) + l * sin(stance), 0.0, -toe * sin(slope) + l * cos(stance)]
        velocity = [v * l * cos(stance), 0.0, -v * l * sin(stance)]
        q, qdot = [*position, 0.0, left, 0.0, right - left], [*velocity, 0.0, vl, 0.0, vr - vl]
        output.SetFromVector([*q, *qdot])

    @staticmethod
    def _collide(context: Context, event: UnrestrictedUpdateEvent, state: State) -> None:
        """An inelastic impact of the swing toe on a body that floats; then the legs change their names."""
        mh, m, l, b, *_ = context.get_numeric_parameter(0)._v
        stance, swing, v, w = context.get_continuous_state_vector()._v
        k, a = m * (l - b) + (m + mh) * l, l - b
        cst, sst, csw, ssw, c = cos(stance), sin(stance), cos(swing), sin(swing), cos(swing - stance)
        M = np.array(
            [
                [2 * m + mh, 0.0, k * cst, -m * b * csw],
                [0.0, 2 * m + mh, -k * sst, m * b * ssw],
                [k * cst, -k * sst, m * a * a + (m + mh) * l * l, -m * l * b * c],
                [-m * b * csw, m * b * ssw, -m * l * b * c, m * b * b],
            ]
        )
        J = np.array([[1.0, 0.0, l * cst, -l * csw], [0.0, 1.0, -l * sst, l * ssw]])
        before = np.array([0.0, 0.0, v, w])
        Minv_JT = np.linalg.solve(M, J.T)
        after = before - Minv_JT @ np.linalg.solve(J @ Minv_JT, J @ before)
        state.get_mutable_continuous_state().SetFromVector([swing, stance, after[3], after[2]])
        toe = context.get_discrete_state(0)[0] - 2.0 * l * sin((swing - stance) / 2.0)
        state.get_mutable_discrete_state().get_mutable_vector(0).SetAtIndex(0, toe)
        left = context.get_abstract_state(0).get_value()
        state.get_mutable_abstract_state().get_mutable_value(0).set_value(not left)


class CompassGaitGeometry(ExampleGeometry):
    """Draws a compass gait on its slope; made by `AddToBuilder`."""

    def __init__(self, params: CompassGaitParams, scene_graph: SceneGraph):
        super().__init__(scene_graph, None, ("floating_base_state", 14))
        slope = RigidTransform(RotationMatrix.MakeYRotation(params.slope()), [0.0, 0.0, 0.0])
        sand = [0.9297, 0.7930, 0.6758, 1]
        self.draw(None, slope @ RigidTransform([0, 0, -5]), Box(100, 1, 10), "ramp", sand)
        legs = [self.add_frame("left_leg")]
        legs.append(self.add_frame("right_leg", legs[0]))
        hip_radius = 0.1
        about_y = RigidTransform(RotationMatrix.MakeXRotation(math.pi / 2), [0.0, 0.0, 0.0])
        self.draw(legs[0], about_y, Sphere(hip_radius), "hip", [0, 1, 0, 1])
        radius = hip_radius * float(np.cbrt(params.mass_leg() / params.mass_hip()))  # both of one density
        length, at = params.length_leg(), params.center_of_mass_leg()
        for leg, name, color in zip(legs, ("left_leg", "right_leg"), ([1, 0, 0, 1], [0, 0, 1, 1])):
            self.draw(leg, RigidTransform([0, 0, -length / 2]), Cylinder(0.0075, length), name, color)
            self.draw(leg, RigidTransform([0, 0, -at]), Sphere(radius), f"{name}_mass", color)

    def poses(self, state: np.ndarray) -> list[RigidTransform]:
        """The pose of the left leg, and of the right leg in it."""
        left = RigidTransform(RollPitchYaw(state[3:6]), state[:3])
        return [left, RigidTransform(RotationMatrix.MakeYRotation(state[6]))]

    @classmethod
    @overloaded(*drawn_in_scene("floating_base_state_port", "compass_gait_params", CompassGaitParams))
    def AddToBuilder(
        cls, builder: DiagramBuilder, state_port: OutputPort, params: CompassGaitParams, scene_graph: SceneGraph
    ) -> CompassGaitGeometry:
        """Adds one to a diagram: `(builder, floating_base_state_port, [compass_gait_params,] scene_graph)`."""
        return cls(params, scene_graph)._add(builder, state_port, scene_graph)
