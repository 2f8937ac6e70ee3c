"""From the registered elements to numbers and arrays: the forest, the parameters, the model of the kernels."""

from __future__ import annotations

from typing import Any

import numpy as np

from sheldrake.math import RigidTransform, RotationMatrix
from sheldrake.multibody.tree import (
    DoorHinge,
    FixedOffsetFrame,
    LinearBushingRollPitchYaw,
    PrismaticJoint,
    QuaternionFloatingJoint,
    RevoluteJoint,
    WeldJoint,
)
from sheldrake.multibody.tree._compile import Mobilizer, TreeDescription, compile_tree
from sheldrake.multibody.tree._force_element import LinearSpringDamper, _JointSpring
from sheldrake.multibody.tree._forest import Step, span_forest
from sheldrake.multibody.tree._frame import pose_numbers
from sheldrake.multibody.tree._kernels.forces import ForceModel
from sheldrake.multibody.tree._rigid_body import inertia_numbers

_EPSILON = np.finfo(float).eps


class Finalization:
    """What `Finalize()` does to the tree."""

    def _finalize_tree(self) -> None:
        floating: list[Any] = []

        def float_body(body: Any) -> Any:
            names = {j.name() for j in (*self._joints, *floating) if j.model_instance() == body.model_instance()}
            name = body.name()
            while name in names:
                name = f"_{name}"
            joint = QuaternionFloatingJoint(name, self.world_frame(), body.body_frame())
            joint._ephemeral = True
            floating.append(joint)
            return joint

        steps = span_forest(list(self._bodies), list(self._joints), float_body)
        for joint in floating:
            self._add_joint(joint)
            if int(joint.child_body().index()) in self._default_free_poses:
                joint.SetDefaultPose(self._default_free_poses[int(joint.child_body().index())])
        self._add_mobilizer_frames(steps)
        self._number(steps)
        self._lay_out_parameters()
        self._tree_model = compile_tree(self._tree_description(steps))
        self._force_model = self._compile_forces()
        self._place_open_points()

    def _add_mobilizer_frames(self, steps: list[Step]) -> None:
        """The frames that Drake's mobilizers have beside those of their joints, so that frames count and list alike.

        Drake turns about and slides along +x, +y and +z only, and welds frames onto each other. The kernels here need
        none of these frames.
        """
        for joint, backwards in ((step.joint, step.reversed) for step in steps):
            F, M = joint.frame_on_parent(), joint.frame_on_child()
            if backwards:
                F, M = M, F
            if isinstance(joint, WeldJoint):
                X_FM = joint.X_FM().inverse() if backwards else joint.X_FM()
                if not X_FM.IsExactlyIdentity():
                    self._add_mobilizer_frame(f"{joint.name()}_{F.name()}_F", F, X_FM, joint)
            elif isinstance(joint, (RevoluteJoint, PrismaticJoint)):
                axis = -joint._axis if backwards else joint._axis
                if max(axis) < 1.0 - _EPSILON:
                    X = RigidTransform(RotationMatrix.MakeFromOneVector(axis, 2))
                    self._add_mobilizer_frame(f"{joint.name()}_{F.name()}_F", F, X, joint)
                    self._add_mobilizer_frame(f"{joint.name()}_{M.name()}_M", M, X, joint)

    def _add_mobilizer_frame(self, name: str, parent: Any, X_PF: RigidTransform, joint: Any) -> None:
        while self._frames.find(name, joint.model_instance()):
            name = f"_{name}"
        self.AddFrame(FixedOffsetFrame(name, parent, X_PF, joint.model_instance()))._ephemeral = True

    def _number(self, steps: list[Step]) -> None:
        """Rows of bodies; starts of positions, velocities and inputs."""
        self._steps = steps
        self._row_bodies = [self.world_body(), *(s.body for s in steps)]
        self._rows = np.zeros(len(self._row_bodies), np.int64)
        self._inboard = {}
        q = v = 0
        for row, step in enumerate(steps, start=1):
            self._rows[int(step.body.index())] = row
            self._inboard[int(step.body.index())] = step
            step.joint._q_start, step.joint._v_start = q, v
            q += step.joint.num_positions()
            v += step.joint.num_velocities()
        self._row_indices = np.array([int(b.index()) for b in self._row_bodies], np.int64)
        self._rows_in_order = bool(np.all(np.diff(self._rows) == 1))
        self._nq, self._nv, u = q, v, 0
        for actuator in self._actuators:
            actuator._input_start = u
            u += actuator.num_inputs()
        self._nu = u

    def _lay_out_parameters(self) -> None:
        """Gives every element its group of numeric parameters, in Drake's order; lock flags come last."""
        self._parameter_models: list[np.ndarray] = []
        self._parameter_starts: list[int] = []
        self._num_parameters = 0

        def take(element: Any, values: Any) -> int:
            self._parameter_models.append(np.asarray(values, float))
            self._parameter_starts.append(self._num_parameters)
            self._num_parameters += len(self._parameter_models[-1])
            return len(self._parameter_models) - 1

        for joint in self._joints:
            joint._group = take(joint, joint.default_damping_vector())
        for actuator in self._actuators:
            actuator._group = take(actuator, [actuator.default_rotor_inertia()])
            take(actuator, [actuator.default_gear_ratio()])
        for body in self._bodies:
            body._group = take(body, inertia_numbers(body.default_spatial_inertia()))
        for frame in self._frames:
            if isinstance(frame, FixedOffsetFrame):
                frame._group = take(frame, pose_numbers(frame._X_PF))
        for element in self._force_elements:
            if element._defaults():
                element._group = take(element, element._defaults())
        for record in self._constraints.values():
            record.group = take(record, [1.0, *record.numbers])
        self._lock_group = take(None, np.zeros(len(self._joints.slots)))

    def _refresh_parameter_models(self) -> None:
        """Defaults that may change after Finalize()."""
        for actuator in self._actuators:
            self._parameter_models[actuator._group][0] = actuator.default_rotor_inertia()
            self._parameter_models[actuator._group + 1][0] = actuator.default_gear_ratio()

    def _start(self, element: Any) -> int:
        """Where the parameters of an element start in p."""
        return self._parameter_starts[element._group]

    def _tree_description(self, steps: list[Step]) -> TreeDescription:
        offset_frames = [f for f in self._frames if isinstance(f, FixedOffsetFrame)]
        self._frame_rows = {int(f.index()): row for row, f in enumerate(offset_frames)}

        def frame_row(frame: Any) -> int:
            return self._frame_rows.get(int(frame.index()), -1)

        description = TreeDescription(frames=[(frame_row(f._parent), self._start(f)) for f in offset_frames])
        for step in steps:
            joint, backwards = step.joint, step.reversed
            F, M = joint.frame_on_parent(), joint.frame_on_child()
            constants = joint._reversed_constants() if backwards else joint._constants()
            start = self._start(joint)
            description.mobilizers.append(
                Mobilizer(
                    parent=int(self._rows[int(step.parent.index())]),
                    type_name=joint.type_name(),
                    inertia=self._start(step.body),
                    frame_F=frame_row(M if backwards else F),
                    frame_M=frame_row(F if backwards else M),
                    constants=constants,
                    path=joint._path_pieces(),
                    damping=tuple(range(start, start + joint.num_velocities())),
                    gravity=tuple(self._gravity_on(step.body)),
                )
            )
        for actuator in self._actuators:
            start = self._start(actuator)
            description.actuators.append((actuator.joint()._v_start, start, start + 1))
        return description

    def _gravity_on(self, body: Any) -> np.ndarray:
        on = self._gravity.is_enabled(body.model_instance())
        return self._gravity.gravity_vector() if on else np.zeros(3)

    def _gravity_changed(self) -> None:
        if self._finalized:
            for body in self._row_bodies[1:]:
                self._tree_model.gravity[self._rows[int(body.index())]] = self._gravity_on(body)
            self._model_changed()

    def _compile_forces(self, only: Any = None) -> ForceModel:
        """Force elements, or only one of them, as arrays."""
        springs, hinges, struts, bushings = [], [], [], []

        def place(frame: Any) -> tuple[int, int]:
            return int(self._rows[int(frame.body().index())]), self._frame_rows.get(int(frame.index()), -1)

        for element in self._force_elements:
            if only is not None and element is not only:
                continue
            if isinstance(element, DoorHinge):
                joint = element.joint()
                hinges.append((joint._v_start, joint._q_start, self._start(element)))
            elif isinstance(element, LinearBushingRollPitchYaw):
                bushings.append((*place(element.frameA()), *place(element.frameC()), self._start(element)))
            elif isinstance(element, _JointSpring):
                joint = element.joint()
                springs.append((joint._v_start, joint._q_start, self._start(element)))
            elif isinstance(element, LinearSpringDamper):
                A, B = element.bodyA(), element.bodyB()
                struts.append((self._rows[int(A.index())], self._rows[int(B.index())], self._start(element)))
        tables = ((springs, 3), (hinges, 3), (struts, 3), (bushings, 5))
        return ForceModel(*(np.array(rows, np.int64).reshape(-1, columns) for rows, columns in tables))

    def _force_model_of(self, element: Any) -> ForceModel:
        """One force element as arrays."""
        return self._compile_forces(element)

    def _inboard_joint(self, body: Any) -> Any:
        step = self._inboard.get(int(body.index()))
        if step is None:
            raise RuntimeError(f"The world body {body.name()!r} has no inboard joint.")
        return step.joint
