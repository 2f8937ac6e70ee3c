"""What a report says of the model, the run and the programs, as tables."""

from __future__ import annotations

import datetime
import importlib.metadata
import platform
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

if TYPE_CHECKING:
    from collections.abc import Iterable

    from sheldrake.multibody.plant import MultibodyPlant
    from sheldrake.multibody.tree import Joint
    from sheldrake.multibody.tree._joint_actuator import JointActuator
    from sheldrake.multibody.tree._rigid_body import RigidBody
    from sheldrake.systems.analysis import Simulator

_PACKAGES = ("numpy", "scipy", "llvmlite", "viser", "trimesh", "matplotlib")
_MOST_ROWS = 300


class Table(NamedTuple):
    """A table of texts.

    Attributes:
        title: Its caption.
        head: Names of the columns.
        rows: Cells, as many a row as there are names.
    """

    title: str
    head: list[str]
    rows: list[list[str]]


def model_tables(plants: list[Any]) -> list[Table]:
    """Bodies, joints and actuators of plants."""
    tables = []
    for plant in plants:
        name = plant.get_name()
        bodies = [_body_row(plant, body) for body in _bodies(plant)]
        mass = sum(body.default_mass() for body in _bodies(plant))
        title = f"Bodies of {name}: {len(bodies)}, {mass:.6g} kg"
        head = ["model", "body", "mass [kg]", "centre of mass [m]", "principal moments [kg m²]"]
        tables.append(_cut(Table(title, head, bodies)))
        joints = [_joint_row(plant.get_joint(i)) for i in plant.GetJointIndices()]
        title = f"Joints of {name}: {plant.num_positions()} positions, {plant.num_velocities()} velocities"
        head = ["joint", "type", "parent", "child", "limits [rad or m]", "damping"]
        tables.append(_cut(Table(title, head, joints)))
        actuators = [_actuator_row(plant.get_joint_actuator(i)) for i in plant.GetJointActuatorIndices()]
        if actuators:
            head = ["actuator", "joint", "effort limit [N m or N]", "gear ratio"]
            tables.append(_cut(Table(f"Actuators of {name}", head, actuators)))
    return tables


def _cut(table: Table) -> Table:
    if len(table.rows) <= _MOST_ROWS:
        return table
    more = [f"and {len(table.rows) - _MOST_ROWS} more", *[""] * (len(table.head) - 1)]
    return table._replace(rows=[*table.rows[:_MOST_ROWS], more])


def _bodies(plant: MultibodyPlant) -> list[Any]:
    from sheldrake.multibody.tree import BodyIndex

    return [plant.get_body(BodyIndex(i)) for i in range(1, plant.num_bodies())]


def _numbers(values: Iterable[float]) -> str:
    return ", ".join(f"{float(v):.4g}" for v in values)


def _body_row(plant: MultibodyPlant, body: RigidBody) -> list[str]:
    M = body.default_spatial_inertia()
    mass, p = float(M.get_mass()), np.asarray(M.get_com())
    moments = np.zeros(3)
    if mass > 0.0:
        moments = np.linalg.eigvalsh(M.Shift(p).CalcRotationalInertia().CopyToFullMatrix3())
    model = plant.GetModelInstanceName(body.model_instance())
    return [model, body.name(), f"{mass:.6g}", _numbers(p), _numbers(moments)]


def _joint_row(joint: Joint) -> list[str]:
    limits = zip(joint.position_lower_limits(), joint.position_upper_limits())
    texts = [f"{a:.4g} to {b:.4g}" for a, b in limits if np.isfinite(a) or np.isfinite(b)]
    damping = np.atleast_1d(joint.default_damping_vector())
    ends = [joint.parent_body().name(), joint.child_body().name()]
    return [joint.name(), joint.type_name(), *ends, "; ".join(texts), _numbers(damping) if damping.any() else ""]


def _actuator_row(actuator: JointActuator) -> list[str]:
    limit = actuator.effort_limit()
    effort = f"{limit:.4g}" if np.isfinite(limit) else "none"
    return [actuator.name(), actuator.joint().name(), effort, f"{actuator.default_gear_ratio():.4g}"]


def facts_of_run(simulator: Simulator, timing: Any) -> list[str]:
    """The run in a line: how far, how fast, in how many steps, when, with what."""
    from sheldrake import __version__

    facts = [f"{timing.simulated:.6g} s simulated"]
    if timing.seconds > 0.0 and timing.simulated > 0.0:
        facts[0] += f" in {timing.seconds:.3g} s, {timing.simulated / timing.seconds:.3g} times real time"
    today = datetime.date.today()
    return [*facts, f"{simulator.get_num_steps_taken()} steps", f"{today}", f"sheldrake {__version__}"]


def run_table(simulator: Simulator) -> Table:
    """What the simulation did, counted."""
    context = simulator.get_context()
    integrator = simulator.get_integrator()
    rows = [
        ["simulated time", f"{context.get_time():.9g} s"],
        ["steps", str(simulator.get_num_steps_taken())],
        ["discrete updates", str(simulator.get_num_discrete_updates())],
        ["unrestricted updates", str(simulator.get_num_unrestricted_updates())],
        ["publishes", str(simulator.get_num_publishes())],
    ]
    if context.num_continuous_states():
        rows.append(["integrator", type(integrator).__name__])
        rows.append(["steps of the integrator", str(integrator.get_num_steps_taken())])
    return Table("The run", ["", ""], rows)


def versions_table(systems: list[Any]) -> Table:
    """Programs, machine, and seeds of random sources."""
    from sheldrake import __version__

    rows = [["sheldrake", __version__], ["python", platform.python_version()]]
    rows.append(["system", f"{platform.system()} {platform.machine()}"])
    for package in _PACKAGES:
        try:
            rows.append([package, importlib.metadata.version(package)])
        except importlib.metadata.PackageNotFoundError:
            continue
    for system in systems:
        if type(system).__name__.startswith("RandomSource"):
            rows.append([f"seed of {system.get_name()}", str(getattr(system, "_seed", "not known"))])
    rows.append(["written", datetime.datetime.now().astimezone().isoformat(timespec="seconds")])
    return Table("Versions", ["", ""], rows)
