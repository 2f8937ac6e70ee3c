"""What `Finalize()` makes of the elements: how they are numbered, and the constant arrays of the tree's kernels."""

from __future__ import annotations

import dataclasses
from collections import Counter
from collections.abc import Iterable
from functools import cached_property
from typing import Any

import numpy as np

from sheldrake.common._copies import deep_copy
from sheldrake.common._overloads import Mismatch
from sheldrake.common.calls import Addresses
from sheldrake.multibody.tree import (
    BodyIndex,
    DoorHinge,
    ForceElement,
    Frame,
    Joint,
    JointActuator,
    LinearBushingRollPitchYaw,
    LinearSpringDamper,
    RigidBody,
)
from sheldrake.multibody.tree._force_element import _JointSpring
from sheldrake.multibody.tree._forest import Step
from sheldrake.multibody.tree._kernels.forces import ForceModel, empty_force_model
from sheldrake.multibody.tree._kernels.model import TreeModel


class Parameters:
    """Where numeric parameters are: groups of them, one after the other in p, and what they are by default."""

    def __init__(self) -> None:
        self.defaults: list[np.ndarray] = []
        """By group."""
        self.starts: list[int] = []
        """By group: the number of its first in p."""
        self._count = 0

    def add(self, values: Any) -> int:
        """A new group; its number."""
        self.defaults.append(np.asarray(values, float))
        self.starts.append(self._count)
        self._count += len(self.defaults[-1])
        return len(self.defaults) - 1

    def of(self, group: int) -> slice:
        """The place of a group in p."""
        return slice(self.starts[group], self.starts[group] + len(self.defaults[group]))

    def all_defaults(self) -> np.ndarray:
        """p of a default context."""
        return np.concatenate([*self.defaults, np.zeros(0)])


_NONE = np.zeros(0)
_NO_FORCES = empty_force_model()
for _array in _NO_FORCES:  # all share it
    _array.flags.writeable = False
_OF_A_BODY = ["mass [kg]", *(f"centre of mass {axis} [m]" for axis in "xyz"),
              *(f"unit inertia {axes} [m^2]" for axes in ("xx", "yy", "zz", "xy", "xz", "yz"))]  # fmt: skip


def _names(elements: Iterable[Any]) -> list[str]:
    """Names of elements; with those of their model instances where there are several of a name."""
    every = list(elements)
    count = Counter(element.name() for element in every)
    return [e.name() if count[e.name()] == 1 else e.scoped_name().get_full() for e in every]


@dataclasses.dataclass(eq=False)
class FrozenModel:
    """The model of a finalized plant.

    Attributes:
        steps: The forest: every body but the world, in the order of its rows.
        joints: All joints.
        actuators: All actuators.
        row_bodies: The body of each row of the kernels' arrays; the world is row 0.
        rows: The row of each body.
        inboard: How bodies hang in the forest, by number; the world does not.
        nq, nv, nu: Numbers of positions, velocities and inputs.
        parameters: Where the numeric parameters are.
        lock_group: The group of them that tells which joints are locked, by number of joint.
        tuning: The groups behind it, that Drake does not have, by name: "gravity" is added to that of all bodies,
            "friction" scales the coefficients of each body, "gains" those of each actuator, p and d.
        frame_rows: Rows of the frames that are fixed to others, by number.
        tree: The tree as arrays.
        forces: All force elements as arrays.
    """

    steps: list[Step]
    joints: list[Joint]
    actuators: list[JointActuator]
    row_bodies: list[RigidBody]
    rows: np.ndarray
    inboard: dict[int, Step]
    nq: int
    nv: int
    nu: int
    parameters: Parameters
    lock_group: int
    tuning: dict[str, int]
    frame_rows: dict[int, int]
    tree: TreeModel
    forces: ForceModel = _NO_FORCES

    @cached_property
    def row_indices(self) -> np.ndarray:
        """The number of the body of each row."""
        return np.array([int(b.index()) for b in self.row_bodies], np.int64)

    @cached_property
    def body_indices(self) -> list[BodyIndex]:
        """The number of the body of each row, as such."""
        return [body.index() for body in self.row_bodies]

    @cached_property
    def row_list(self) -> list[int]:
        """`rows` as Python's numbers, which are quicker one by one."""
        return self.rows.tolist()

    @cached_property
    def rows_by_joint(self) -> np.ndarray:
        """The row of the body outboard of each joint; 0 for one that holds none."""
        row_of = {int(step.joint.index()): row for row, step in enumerate(self.steps, start=1)}
        return np.array([row_of.get(int(joint.index()), 0) for joint in self.joints] or [0], np.int64)

    @cached_property
    def rotors_at(self) -> np.ndarray:
        """Where in p the rotor inertia and the gear ratio of each actuator are, shape (number of actuators, 2)."""
        starts = [self.start_of(actuator) for actuator in self.actuators]
        return np.array(starts, np.int64).reshape(-1, 1) + np.arange(2)

    @cached_property
    def joints_by_coordinate(self) -> list[Joint]:
        """The joints that have positions, in the order of these, which is that of their velocities too."""
        return sorted((joint for joint in self.joints if joint.num_positions()), key=lambda joint: joint._q_start)

    @cached_property
    def bodies_of_instances(self) -> dict[tuple[int, ...] | None, tuple[np.ndarray, bool]]:
        """By numbers of model instances, None for all but the world: 1 for their bodies, by row, else 0; if any is."""
        return {}

    @cached_property
    def damping_at(self) -> np.ndarray:
        """Where in p the damping of each velocity is."""
        at = np.zeros(self.nv, np.int64)
        for joint in self.joints:
            n = joint.num_velocities()
            at[joint._v_start : joint._v_start + n] = self.start_of(joint) + np.arange(n)
        return at

    @cached_property
    def rows_in_order(self) -> bool:
        """Whether bodies have their numbers for rows."""
        return bool(np.all(np.diff(self.rows) == 1))

    @cached_property
    def v_is_qdot(self) -> bool:
        """Whether qdot = v for all joints."""
        return all(joint._type.v_is_qdot for joint in self.joints)

    @property
    def num_bodies(self) -> int:
        """How many bodies there are, the world included."""
        return len(self.row_bodies)

    def row_of(self, body: RigidBody) -> int:
        """The row of a body."""
        return self.rows[body._index._value]

    def inboard_of(self, body: RigidBody) -> Step | None:
        """How a body hangs in the forest; None for the world."""
        return self.inboard.get(int(body.index()))

    def place_of(self, frame: Frame) -> tuple[int, int]:
        """Row of the body of a frame, and row of the frame: -1 for the body's own.

        Raises:
            TypeError: it is no frame.
        """
        try:
            body = frame._body
        except AttributeError:
            raise Mismatch(
                f"incompatible function arguments: {frame!r} is no frame; a body has body_frame()."
            ) from None
        return self.rows[body._index._value], self.frame_rows.get(frame._index._value, -1)

    def gains_at(self, actuator: JointActuator) -> int:
        """Where in p is what an actuator's gains are multiplied with."""
        return self.parameters.starts[self.tuning["gains"]] + 2 * self.actuators.index(actuator)

    def start_of(self, element: Any) -> int:
        """Where the parameters of an element start in p."""
        return self.parameters.starts[element._group]

    def parameter_names(self) -> dict[int, tuple[str, list[str]]]:
        """What groups of parameters are of, and what each of their numbers is, its unit in brackets; by group."""
        bodies = [body for _, body in sorted(zip(self.row_indices, self.row_bodies), key=lambda pair: pair[0])]
        joints, actuators = _names(self.joints), _names(self.actuators)
        found = {
            self.tuning["gravity"]: ("added gravity", [f"{axis} [m/s^2]" for axis in "xyz"]),
            self.tuning["friction"]: ("scale of friction", _names(bodies)),
            self.tuning["gains"]: ("scale of gains", [f"{gain} of {name}" for name in actuators for gain in "pd"]),
        }
        for joint, name in zip(self.joints, joints):
            n = joint.num_velocities()
            found[joint._group] = f"joint {name}", ["damping"] if n == 1 else [f"damping {k}" for k in range(n)]
        for actuator, name in zip(self.actuators, actuators):
            found[actuator._group] = f"rotor of {name}", ["inertia [kg m^2]"]
            found[actuator._group + 1] = f"gear of {name}", ["ratio [1]"]
        for body, name in zip(bodies, _names(bodies)):
            found[body._group] = f"body {name}", _OF_A_BODY
        return found

    def default_positions(self) -> np.ndarray:
        """Positions of a default context, shape (nq,)."""
        return np.concatenate([_NONE, *(joint._default_q for joint in self.joints_by_coordinate)])

    def forces_of(self, elements: Iterable[ForceElement]) -> ForceModel:
        """Force elements as arrays."""
        springs, hinges, struts, bushings = [], [], [], []
        for element in elements:
            if isinstance(element, DoorHinge):
                joint = element.joint()
                hinges.append((joint._v_start, joint._q_start, self.start_of(element)))
            elif isinstance(element, LinearBushingRollPitchYaw):
                A, C = self.place_of(element.frameA()), self.place_of(element.frameC())
                bushings.append((*A, *C, self.start_of(element)))
            elif isinstance(element, _JointSpring):
                joint = element.joint()
                springs.append((joint._v_start, joint._q_start, self.start_of(element)))
            elif isinstance(element, LinearSpringDamper):
                ends = self.row_of(element.bodyA()), self.row_of(element.bodyB())
                struts.append((*ends, self.start_of(element)))
        tables: list[list[tuple]] = [springs, hinges, struts, bushings]
        if not any(tables):
            return _NO_FORCES
        arrays = zip(tables, _NO_FORCES)
        return ForceModel(*(np.array(rows, np.int64) if rows else empty for rows, empty in arrays))

    @cached_property
    def addresses(self) -> Addresses:
        """Where the arrays of queries are (see `_context.queries`)."""
        return Addresses.of((*self.tree, *self.forces, self.damping_at, self.rows), self.joints)

    def __getstate__(self) -> dict[str, Any]:
        """A copy in another process has its own addresses."""
        return {name: value for name, value in self.__dict__.items() if name != "addresses"}

    def __deepcopy__(self, memo: dict) -> FrozenModel:
        """A copy for copies of the elements, with the same arrays."""
        names = ("steps", "joints", "actuators", "row_bodies", "inboard")
        return dataclasses.replace(self, **{name: deep_copy(getattr(self, name), memo) for name in names})
