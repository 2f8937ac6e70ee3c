"""Why a plant's kernels could not go on, in words."""

from __future__ import annotations

from typing import Any

import numpy as np

from sheldrake.geometry._compiled.hydroelastic import explain_unsupported, face_capacity
from sheldrake.multibody.contact_solvers._kernels.problem import V_STAR
from sheldrake.multibody.contact_solvers._kernels.status import MOTION_NOT_FINITE
from sheldrake.multibody.contact_solvers._status import SOLVE_FAILURES, explain_solver_status
from sheldrake.multibody.plant._kernels.hydro_rows import HYDRO_CAPACITY, HYDRO_UNSUPPORTED_PAIR
from sheldrake.multibody.plant._kernels.ports import CONSTRAINTS_IN_CONTINUOUS_TIME, GEOMETRY_NOT_CONNECTED
from sheldrake.multibody.plant._step.results import bodies_at_hand


def explain_failure(plant: Any, status: int, context: Any) -> Exception:
    """The error for a status that a kernel of the plant gave."""
    if status == GEOMETRY_NOT_CONNECTED:
        return RuntimeError(
            f"{plant._describe()}: it has {plant.num_collision_geometries()} collision geometries, but its "
            "geometry_query input port is not connected to a SceneGraph here. Use the context of the diagram that "
            "holds both (plant.GetMyContextFromRoot(diagram_context)), or AddMultibodyPlantSceneGraph()."
        )
    if status == CONSTRAINTS_IN_CONTINUOUS_TIME:
        return RuntimeError(
            f"{plant._describe()}: it has {len(plant._constraints)} constraints, and continuous time does not "
            "support constraints. Give the plant a time step."
        )
    if status == HYDRO_UNSUPPORTED_PAIR:
        geometry, table = plant._geometry_of(context), context._store.scratch(context._node).table
        return _explain_refused(plant, geometry.state, table, geometry.ids)
    if status == HYDRO_CAPACITY:
        room = face_capacity(plant._geometry_of(context).hydro)
        return RuntimeError(
            f"{plant._describe()} at time {context.get_time()}: contact surfaces have more faces than there is room "
            f"for ({room}), and none is dropped silently. Try larger resolution hints, coarser meshes, or "
            "collision filters."
        )
    text = f"{plant._describe()} at time {context.get_time()}: {explain_solver_status(status)}"
    if status in SOLVE_FAILURES and plant._sampled:
        text += f" It happened among: {_bodies_at_hand(plant, context)}."
    if status == MOTION_NOT_FINITE:
        text += _where_not_finite(plant, context)
    return RuntimeError(text)


def _bodies_at_hand(plant: Any, context: Any) -> str:
    rows = bodies_at_hand(context._store.scratch(context._node), plant._tree_model)
    names = [repr(plant._row_bodies[row].name()) for row in rows]
    return ", ".join(names[:10]) + (f" and {len(names) - 10} more" if len(names) > 10 else "")


def _where_not_finite(plant: Any, context: Any) -> str:
    """The input ports that bring such numbers, in Drake's words; without one, the joints that move so."""
    for i in range(plant.num_input_ports()):
        port = plant.get_input_port(i)
        value = port.Eval(context) if port.HasValue(context) else None
        if isinstance(value, np.ndarray) and not np.all(np.isfinite(value.astype(float))):
            whose = port.get_name().removesuffix("_actuation")
            if whose == "actuation":
                return " Detected NaN in the actuation input port for all instances."
            if whose != port.get_name():
                return f" Detected NaN in the actuation input port for model instance {whose}."
            return f" Detected NaN in the input port {port.get_name()}."
    v_star = context._store.scratch(context._node).problem.x[V_STAR].astype(float)
    names = [
        repr(joint.name())
        for joint in plant._joints
        if not np.all(np.isfinite(v_star[joint.velocity_start() : joint.velocity_start() + joint.num_velocities()]))
    ]
    return f" It happened at the joints {', '.join(names[:10])}."


def _explain_refused(plant: Any, state: Any, table: Any, ids: list) -> Exception:
    """Which geometries overlap that can have no contact surface."""
    for row in range(int(table.count[0])):
        if table.point[row, 9] > 0.0:
            a, b = table.pair[row, :2]
            return explain_unsupported(state, ids[a], ids[b])
    return RuntimeError(f"{plant._describe()}: geometries overlap that can have no contact surface.")
