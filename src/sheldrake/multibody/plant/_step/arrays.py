"""The discrete step's own constants and scratch, made once from counts."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from sheldrake.geometry._compiled.hydroelastic import face_capacity
from sheldrake.geometry._kernels.hydro_model import HydroModel, HydroTable, empty_hydro_model, hydro_table
from sheldrake.geometry._kernels.model import ContactTable, GeometryModel, contact_table, empty_geometry_model
from sheldrake.geometry._kernels.spatial_hash import Cells, make_cells
from sheldrake.multibody.contact_solvers._arrays import make_solver_work
from sheldrake.multibody.contact_solvers._kernels.problem import SolverModel
from sheldrake.multibody.plant._kernels.model import (
    BALL,
    COUPLER,
    DISTANCE,
    TENDON,
    WELD,
    Actuator,
    Belt,
    BeltAxis,
    Bound,
    Constraint,
    Gain,
    Limit,
    PlantModel,
    StepVectors,
    StepWork,
    TendonJoint,
)
from sheldrake.multibody.tree._kernels.model import TreeModel, make_work
from sheldrake.systems.framework._engine.scratch import arrays_of, size_of

CONSTRAINT_KINDS = {
    "coupler": (COUPLER, 1),
    "distance": (DISTANCE, 1),
    "ball": (BALL, 3),
    "weld": (WELD, 6),
    "tendon": (TENDON, 2),
}
"""Kind and number of rows of each constraint."""


def make_plant_model(
    actuators: Sequence[dict] = (),
    limits: Sequence[dict] = (),
    force_ports: Sequence[int] = (),
    constraints: Sequence[dict] = (),
    locks: Sequence[int] | np.ndarray = (),
    frictions: Sequence[tuple[int, float]] = (),
    belts: Sequence[tuple[int, np.ndarray]] = (),
) -> PlantModel:
    """The constants of the step that are neither tree nor geometry nor solver.

    Args:
        actuators: one a plant's actuator, in order, by names: dof, q (needed with gains), port and element of the
            plant's actuation input, instance_port and instance_element of the model instance's, effort_limit, and with
            PD gains p, d, desired_port, desired_q, desired_v. Ports are indices among the vector inputs, -1 for none.
        limits: one a one-dof joint with a position limit, by names: dof, q, lower, upper, and for kTamsi stiffness and
            damping (see `tamsi_limit_penalty`).
        force_ports: vector inputs that hold generalized forces of all dofs.
        constraints: one a holonomic constraint, by names: kind ("coupler", "distance", "ball", "weld"), a and b (dofs
            of a coupler, else body rows), q_a and q_b (a coupler's positions), p (where in p its numbers start, see
            `Constraint`), active (where in p a positive number says that it acts).
        locks: where in p the lock flag of each dof is; empty when no joint can be locked.
        frictions: dof and largest effort of each dry friction.
        belts: row and axis of each body whose surface runs.
    """
    of_actuators = list(map(actuator_arrays, actuators))
    actuator = np.array([words for words, _ in of_actuators], np.int64)
    gain = np.array([gains for _, gains in of_actuators])
    limit = np.array([[a["dof"], a["q"]] for a in limits], np.int64)
    bound = np.array([[a["lower"], a["upper"], a.get("stiffness", 0.0), a.get("damping", 0.0)] for a in limits])
    tendons = [joint for c in constraints for joint in c.get("joints", ())]
    rows = np.array(
        [
            [CONSTRAINT_KINDS[c["kind"]][0], c["a"], c["b"], c.get("q_a", -1), c.get("q_b", -1), c["p"], c["active"]]
            for c in constraints
        ],
        np.int64,
    )
    return PlantModel(
        actuator.reshape(-1, Actuator.SIZE),
        gain.reshape(-1, Gain.SIZE),
        limit.reshape(-1, Limit.SIZE),
        bound.reshape(-1, Bound.SIZE),
        np.array(force_ports, np.int64),
        rows.reshape(-1, Constraint.SIZE),
        np.array(tendons, np.int64).reshape(-1, TendonJoint.SIZE),
        np.array([dof for dof, _ in frictions], np.int64),
        np.array([effort for _, effort in frictions], float),
        np.array(locks, np.int64),
        np.array([row for row, _ in belts], np.int64).reshape(-1, Belt.SIZE),
        np.array([axis for _, axis in belts], float).reshape(-1, BeltAxis.SIZE),
    )


def actuator_arrays(a: dict) -> tuple[list[int], list[float]]:
    """An `Actuator` and its `Gain`, of what `make_plant_model` is told about it."""
    words = [a.get(f.name, -1) for f in Actuator.FIELDS]
    return words, [a.get("effort_limit", np.inf), a.get("p", 0.0), a.get("d", 0.0)]


def make_step_work(
    tree_model: TreeModel,
    solver_model: SolverModel,
    plant_model: PlantModel,
    table: ContactTable,
    dtype: type = float,
    hydro_model: HydroModel | None = None,
    cells: Cells | None = None,
    pushes: bool = False,
) -> StepWork:
    """The scratch of a step; room for as many contacts as the tables hold, and all limits and actuators.

    Args:
        tree_model: the tree.
        solver_model: the solver's constants.
        plant_model: the plant's constants.
        table: an empty contact table, see `contact_table`.
        dtype: float, or object for duals and symbols.
        hydro_model: pairs of geometries that touch along surfaces.
        cells: scratch of the broad phase, see `make_cells`.
        pushes: whether spatial forces are applied.
    """
    cells = cells or make_cells(empty_geometry_model())
    tree = make_work(tree_model, dtype)
    hydro_model = hydro_model or empty_hydro_model()
    surfaces = hydro_table(hydro_model, face_capacity(hydro_model))
    rows_of = dict(CONSTRAINT_KINDS.values())
    rows = 2 * len(plant_model.limit) + len(plant_model.actuator) + len(plant_model.friction)
    rows += sum(rows_of[kind] for kind in plant_model.constraint[:, Constraint.kind])
    contacts = len(table.pair) + len(surfaces.face)
    width, of_bodies = widest_tendon(plant_model), len(plant_model.constraint) > 0
    solver = make_solver_work(solver_model, contacts, rows, dtype, width, of_bodies)
    nv = len(tree_model.dof)

    def numbers(*shape: int) -> np.ndarray:
        return np.zeros(shape) if dtype is float else np.full(shape, 0.0, dtype=dtype)

    def convert(a: np.ndarray) -> np.ndarray:
        return a if dtype is float or a.dtype == np.int64 else a.astype(dtype)

    actuators, belts = len(plant_model.actuator), len(plant_model.belt)
    turns, pushed = numbers(len(tree_model.body) if belts else 0, 3), numbers(len(tree_model.body) if pushes else 0, 6)
    vectors = numbers(nv), numbers(nv), numbers(nv), numbers(actuators), numbers(nv), numbers(belts)
    step = StepVectors(*vectors, turns, pushed)
    tables = ContactTable(*(convert(a) for a in table)), HydroTable(*(convert(a) for a in surfaces))
    return StepWork(tree, tables[0], *solver, step, tables[1], Cells(*(convert(a) for a in cells)))


def step_work_of(
    tree_model: TreeModel,
    solver_model: SolverModel,
    plant_model: PlantModel,
    geometry_model: GeometryModel,
    hydro_model: HydroModel,
    pushes: bool,
) -> StepWork:
    """The scratch of a step with some geometry, to be copied; plants that need the same share its arrays."""
    key = (
        *(tree_model.body.tobytes(), tree_model.dof.tobytes(), solver_model.sides),
        *(*map(len, plant_model), plant_model.constraint.tobytes()),
        *(len(geometry_model.geometry), len(geometry_model.pair), len(geometry_model.cell)),
        *(geometry_model.family.tobytes(), len(hydro_model.geometry), pushes),
    )
    work = _MADE.get(key)
    if work is None:
        table, cells = contact_table(geometry_model), make_cells(geometry_model)
        work = make_step_work(tree_model, solver_model, plant_model, table, float, hydro_model, cells, pushes)
        if len(hydro_model.geometry) or size_of(work) > _LARGE:
            return work
        for array in arrays_of(work):
            array.flags.writeable = False
        if len(_MADE) >= _MOST_MADE:
            _MADE.clear()
        _MADE[key] = work
    return StepWork(*work)  # who compares it with another finds out whether it is of the same geometry


_MADE: dict[tuple[Any, ...], StepWork] = {}
_MOST_MADE, _LARGE = 32, 1 << 18  # works, numbers


def widest_tendon(plant_model: PlantModel) -> int:
    """Most joints that a tendon lies on."""
    tendons = plant_model.constraint[plant_model.constraint[:, Constraint.kind] == TENDON]
    return int(np.max(tendons[:, Constraint.B] - tendons[:, Constraint.A], initial=0))
