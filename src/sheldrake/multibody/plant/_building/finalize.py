"""From the registered elements to numbers and arrays: the forest, the parameters, the model of the kernels."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from sheldrake.math import RigidTransform, RotationMatrix
from sheldrake.multibody.plant._building.elements import ConstraintRecord, Elements
from sheldrake.multibody.plant._building.frozen_model import FrozenModel, Parameters
from sheldrake.multibody.tree import (
    FixedOffsetFrame,
    Frame,
    Joint,
    RigidBody,
    WeldJoint,
)
from sheldrake.multibody.tree._compile import Mobilizer, TreeDescription, compile_tree
from sheldrake.multibody.tree._forest import Step, span_forest
from sheldrake.multibody.tree._frame import pose_numbers
from sheldrake.multibody.tree._kernels import kinematics
from sheldrake.multibody.tree._kernels.model import make_work
from sheldrake.multibody.tree._rigid_body import inertia_numbers

_EPSILON = np.finfo(float).eps


def freeze(elements: Elements, base_joint: Callable[[str, RigidBody], Joint]) -> FrozenModel:
    """The model of a plant; adds the floating joints of free bodies and the frames that mobilizers have.

    Args:
        elements: What was registered; constraints get their groups of parameters and their open points.
        base_joint: Makes the joint of a name that holds a body to the world because no other does.

    Raises:
        RuntimeError: the joints do not make a forest.
    """
    constraints = list(elements.constraints.values())
    steps = _span(elements, base_joint)
    _add_mobilizer_frames(elements, steps)
    numbers = _number(elements, steps)
    parameters, lock_group = _lay_out_parameters(elements, constraints)
    tuning = {
        "gravity": parameters.add(np.zeros(3)),
        "friction": parameters.add(np.ones(len(elements.bodies))),
        "gains": parameters.add(np.ones(2 * len(elements.actuators))),
    }
    offset_frames = [f for f in elements.frames if isinstance(f, FixedOffsetFrame)]
    frame_rows = {int(f.index()): row for row, f in enumerate(offset_frames)}
    description = _describe(elements, steps, numbers["rows"], parameters, tuning, offset_frames, frame_rows)
    model = FrozenModel(
        steps=steps,
        joints=list(elements.joints),
        actuators=list(elements.actuators),
        **numbers,
        parameters=parameters,
        lock_group=lock_group,
        tuning=tuning,
        frame_rows=frame_rows,
        tree=compile_tree(description),
    )
    model.forces = model.forces_of(elements.force_elements)
    _place_open_points(model, constraints)
    return model


def _span(elements: Elements, base_joint: Callable[[str, RigidBody], Joint]) -> list[Step]:
    """The forest; bodies that no joint holds float."""
    floating: list[Joint] = []
    taken: set[tuple[int, str]] = set()

    def float_body(body: RigidBody) -> Joint:
        if not floating:
            taken.update((int(j.model_instance()), j.name()) for j in elements.joints)
        instance, name = int(body.model_instance()), body.name()
        while (instance, name) in taken:
            name = f"_{name}"
        taken.add((instance, name))
        joint = base_joint(name, body)
        joint._ephemeral = True
        floating.append(joint)
        return joint

    steps = span_forest(list(elements.bodies), list(elements.joints), float_body)
    for joint in floating:
        elements.add_joint(joint)
    return steps


def _add_mobilizer_frames(elements: Elements, steps: list[Step]) -> None:
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
                _add_mobilizer_frame(elements, f"{joint.name()}_{F.name()}_F", F, X_FM, joint)
        elif joint._axis is not None and joint._type.mobilizer_axis:
            axis = -joint._axis if backwards else joint._axis
            if max(axis) < 1.0 - _EPSILON:
                X = RigidTransform(RotationMatrix.MakeFromOneVector(axis, 2))
                _add_mobilizer_frame(elements, f"{joint.name()}_{F.name()}_F", F, X, joint)
                _add_mobilizer_frame(elements, f"{joint.name()}_{M.name()}_M", M, X, joint)


def _add_mobilizer_frame(elements: Elements, name: str, parent: Frame, X_PF: RigidTransform, joint: Joint) -> None:
    while elements.frames.find(name, joint.model_instance()):
        name = f"_{name}"
    elements.AddFrame(FixedOffsetFrame(name, parent, X_PF, joint.model_instance()))._ephemeral = True


def _number(elements: Elements, steps: list[Step]) -> dict[str, Any]:
    """Rows of bodies; starts of positions, velocities and inputs."""
    row_bodies = [elements.world, *(s.body for s in steps)]
    rows = np.zeros(len(row_bodies), np.int64)
    inboard = {}
    q = v = u = 0
    for row, step in enumerate(steps, start=1):
        rows[int(step.body.index())] = row
        inboard[int(step.body.index())] = step
        step.joint._q_start, step.joint._v_start = q, v
        q += step.joint.num_positions()
        v += step.joint.num_velocities()
    for actuator in elements.actuators:
        actuator._input_start = u
        u += actuator.num_inputs()
    return dict(row_bodies=row_bodies, rows=rows, inboard=inboard, nq=q, nv=v, nu=u)


def _lay_out_parameters(elements: Elements, constraints: list[ConstraintRecord]) -> tuple[Parameters, int]:
    """Gives every element its group of numeric parameters, in Drake's order; lock flags come last."""
    parameters = Parameters()
    for joint in elements.joints:
        joint._group = parameters.add(joint.default_damping_vector())
    for actuator in elements.actuators:
        actuator._group = parameters.add([actuator.default_rotor_inertia()])
        parameters.add([actuator.default_gear_ratio()])
    for body in elements.bodies:
        body._group = parameters.add(inertia_numbers(body.default_spatial_inertia()))
    for frame in elements.frames:
        if isinstance(frame, FixedOffsetFrame):
            frame._group = parameters.add(pose_numbers(frame._X_PF))
    for element in elements.force_elements:
        if element._defaults():
            element._group = parameters.add(element._defaults())
    for record in constraints:
        record.group = parameters.add([1.0, *record.numbers])
    return parameters, parameters.add(np.zeros(len(elements.joints.slots)))


def _describe(
    elements: Elements,
    steps: list[Step],
    rows: np.ndarray,
    parameters: Parameters,
    tuning: dict[str, int],
    offset_frames: list[FixedOffsetFrame],
    frame_rows: dict[int, int],
) -> TreeDescription:
    """The tree in words that its compiler takes."""

    starts = parameters.starts

    def frame_row(frame: Frame) -> int:
        return frame_rows.get(int(frame._index), -1)

    first_gravity, first_friction = (starts[tuning[what]] for what in ("gravity", "friction"))
    description = TreeDescription(
        frames=[(frame_row(f._parent), starts[f._group]) for f in offset_frames], friction_of_world=first_friction
    )
    gravity, row_of = tuple(elements.gravity.gravity_vector().tolist()), rows.tolist()
    for step in steps:
        joint, backwards = step.joint, step.reversed
        F, M = (joint._M, joint._F) if backwards else (joint._F, joint._M)
        start, falls = starts[joint._group], elements.gravity.is_enabled(step.body._instance)
        description.mobilizers.append(
            Mobilizer(
                parent=row_of[int(step.parent._index)],
                type_name=joint.type_name(),
                inertia=starts[step.body._group],
                frame_F=frame_row(F),
                frame_M=frame_row(M),
                constants=joint._reversed_constants() if backwards else joint._constants(),
                path=joint._path_pieces(),
                damping=tuple(range(start, start + joint.num_velocities())),
                gravity=gravity if falls else (0.0, 0.0, 0.0),
                added_gravity=first_gravity if falls else -1,
                friction=first_friction + int(step.body._index),
            )
        )
    for actuator in elements.actuators:
        start = starts[actuator._group]
        description.actuators.append((actuator.joint()._v_start, start, start + 1))
    return description


def _place_open_points(model: FrozenModel, constraints: list[ConstraintRecord]) -> None:
    """Points of balls that are where the other one is at the default positions."""
    if not any(record.open_point for record in constraints):
        return
    work = make_work(model.tree)
    kinematics.position_kinematics(model.tree, model.parameters.all_defaults(), work, model.default_positions())
    for record in constraints:
        if record.open_point:
            A, B = (work[model.row_of(body)] for body in (record.A, record.B))
            p_WP = np.array(A.p_WB) + np.reshape(A.R_WB, (3, 3)) @ record.numbers[:3]
            record.numbers[3:6] = np.reshape(B.R_WB, (3, 3)).T @ (p_WP - np.array(B.p_WB))
            model.parameters.defaults[record.group][4:7] = record.numbers[3:6]
