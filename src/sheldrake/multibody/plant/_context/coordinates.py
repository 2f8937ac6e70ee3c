"""Positions, velocities and inputs of a plant: numbers, names, limits, defaults, reading and writing them."""

from __future__ import annotations

import operator
from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike

from sheldrake.common._checked import checked
from sheldrake.common._kinds import flag, instance_of
from sheldrake.common._overloads import Mismatch, overload, overloaded
from sheldrake.common._scalars import writable
from sheldrake.multibody.plant._building.elements import Elements
from sheldrake.multibody.plant._building.frozen_model import FrozenModel
from sheldrake.multibody.plant._context.contexts import Contexts
from sheldrake.multibody.tree import Joint, JointActuator, JointIndex, ModelInstanceIndex
from sheldrake.multibody.tree._element import finite, vector
from sheldrake.systems.framework import Context
from sheldrake.systems.framework._vector import lifted

if TYPE_CHECKING:
    from scipy.sparse import csc_matrix

    from sheldrake.multibody.plant._context.view import View


# Of names: of all model instances or of one, and whether each says what tells the positions of a joint apart.
_OF_ALL: dict[str, Any] = {"add_model_instance_prefix": (flag, True)}
_OF_ONE: dict[str, Any] = {
    "model_instance": instance_of(ModelInstanceIndex),
    "add_model_instance_prefix": (flag, False),
}
_SUFFIX: dict[str, Any] = {"always_add_suffix": (flag, True)}
_NAMES = {"q": "q", "v": "v", "qv": "q_v"}
_WORDS = {"q": "positions", "v": "velocities", "qv": "positions and velocities"}


def _setter(call: str, parts: str, quick: str) -> Callable[..., None]:
    """A method that sets positions ("q"), velocities ("v") or both ("qv").

    Its quick way asks the view's builtin function `quick`.
    """
    writer = operator.attrgetter(quick)

    def set_values(self: Any, context: Context, values: Any = None, *rest: Any, **named: Any) -> None:
        try:  # the one that has to be quick
            view = context._kept or self._contexts.view(context)
            if context._store.claimed:
                context._store.check_thread()
            if view.family is self._contexts.family and not named:
                whole = values if not rest else self._with_part(view, parts, values, *rest)
                if type(whole) is list:
                    whole = np.array(whole)  # of floats, or `_write` says what it is
                if whole is not None and not writer(view)(whole):
                    return
        except (AttributeError, ValueError):
            pass
        self._write(call, context, parts, (values, *rest), named)

    set_values.__name__, set_values.__qualname__ = call, f"MultibodyPlant.{call}"
    set_values.__doc__ = f"""Sets {_WORDS[parts]}: those of all, or of one model instance.

        Called as `(context, {_NAMES[parts]})` or `(context, model_instance, {_NAMES[parts]})`.

        Raises:
            RuntimeError: the size is wrong or a number is not finite.
        """
    return set_values


class Coordinates:
    """Positions, velocities and inputs: how many there are, what they are called, and reading and writing them.

    Args:
        elements: Joints and actuators, which have them.
        contexts: Where they are.
    """

    def __init__(self, elements: Elements, contexts: Contexts) -> None:
        self._elements, self._contexts = elements, contexts
        self._of_instance: dict[tuple[str, int], np.ndarray] = {}
        self._names: dict[tuple, list[str]] = {}
        self._limits_of_joints: dict[tuple[str, int], np.ndarray] = {}
        self._limits_changed = -1
        self._actuation_matrix: np.ndarray | None = None

    # --- which

    def count(self, call: str, which: str, model_instance: ModelInstanceIndex | None) -> int:
        """Number of positions ("q") or velocities ("v"), of all or of one model instance."""
        if model_instance is None:
            model = self._elements.model(call)
            return model.nq if which == "q" else model.nv
        return len(self.indices(call, which, model_instance))

    def indices(self, call: str, which: str, model_instance: ModelInstanceIndex | None) -> np.ndarray:
        """Numbers of the positions ("q") or velocities ("v") of a model instance, ascending; all for None."""
        model = self._elements.model(call)
        if model_instance is None:
            return np.arange(model.nq if which == "q" else model.nv)
        self._elements.require_instance(call, model_instance)
        key = which, int(model_instance)
        if key not in self._of_instance:
            self._sort_by_instance(which)
        return self._of_instance[key]

    def state_indices(self, call: str, model_instance: ModelInstanceIndex) -> np.ndarray:
        """Numbers of the positions, then the velocities of a model instance among those of all."""
        self._elements.require_instance(call, model_instance)
        found = self._of_instance.get(("qv", int(model_instance)))
        if found is None:
            q, v = (self.indices(call, which, model_instance) for which in "qv")
            found = self._of_instance["qv", int(model_instance)] = np.concatenate([q, self._model.nq + v])
        return found

    def _sort_by_instance(self, which: str) -> None:
        """Finds the numbers of all model instances in one go."""
        numbers: dict[int, list[int]] = {i: [] for i in range(self._elements.num_model_instances())}
        for j in self._elements.joints:
            first, count = (j._q_start, j.num_positions()) if which == "q" else (j._v_start, j.num_velocities())
            numbers[int(j.model_instance())] += range(first, first + count)
        for i, found in numbers.items():
            self._of_instance[which, i] = np.array(sorted(found), np.int64)

    def actuators_of(self, call: str, model_instance: ModelInstanceIndex | None) -> list[JointActuator]:
        """All actuators, or after Finalize() those of one model instance."""
        if model_instance is None:
            return list(self._elements.actuators)
        self._elements.require_finalized(call)
        self._elements.require_instance(call, model_instance)
        return self._elements.actuators.of_instance(model_instance)

    def input_indices(self, call: str, model_instance: ModelInstanceIndex | None) -> np.ndarray:
        """Numbers of the inputs of a model instance in the actuation vector."""
        self._elements.require_finalized(call)
        if model_instance is not None:
            self._elements.require_instance(call, model_instance)
        key = "u", -1 if model_instance is None else int(model_instance)
        if key not in self._of_instance:
            actuators = self.actuators_of(call, model_instance)
            numbers = [a._input_start + k for a in actuators for k in range(a.num_inputs())]
            self._of_instance[key] = np.array(numbers, np.int64)
        return self._of_instance[key]

    @property
    def _model(self) -> FrozenModel:
        return self._elements.model("MultibodyPlant")

    # --- counts

    def num_positions(self, model_instance: ModelInstanceIndex | None = None) -> int:
        """Number of positions, of all or of one model instance."""
        return self.count("num_positions", "q", model_instance)

    def num_velocities(self, model_instance: ModelInstanceIndex | None = None) -> int:
        """Number of velocities, of all or of one model instance."""
        return self.count("num_velocities", "v", model_instance)

    def num_multibody_states(self, model_instance: ModelInstanceIndex | None = None) -> int:
        """Number of positions and velocities, of all or of one model instance."""
        call = "num_multibody_states"
        return self.count(call, "q", model_instance) + self.count(call, "v", model_instance)

    def num_misc_continuous_states(self) -> int:
        """Number of continuous variables that are neither positions nor velocities: how far belts have come.

        Raises:
            RuntimeError: before Finalize().
        """
        self._elements.require_finalized("num_misc_continuous_states")
        return self._contexts.num_misc_states()

    def num_actuators(self, model_instance: ModelInstanceIndex | None = None) -> int:
        """Number of actuators, of all or of one model instance."""
        if model_instance is None:
            return len(self._elements.actuators)
        return len(self.actuators_of("num_actuators", model_instance))

    def num_actuated_dofs(self, model_instance: ModelInstanceIndex | None = None) -> int:
        """Number of velocities with actuators, of all or of one model instance."""
        if self._elements.is_finalized():
            return len(self.input_indices("num_actuated_dofs", model_instance))
        return sum(a.num_inputs() for a in self.actuators_of("num_actuated_dofs", model_instance))

    # --- names

    def _known_names(self, *which: Any) -> list[str]:
        """What `_new_names` gives, kept, as no name changes."""
        names = self._names.get(which)
        if names is None:
            make = self._new_actuator_names if which[0] == "GetActuatorNames" else self._new_names
            names = self._names[which] = make(*which)
        return names.copy()

    def _new_names(
        self, call: str, of_q: bool, model_instance: ModelInstanceIndex | None, prefix: bool, always_add_suffix: bool
    ) -> list[str]:
        model = self._elements.model(call)
        names: np.ndarray = np.empty(model.nq if of_q else model.nv, dtype=object)
        for joint in model.joints:
            count = joint.num_positions() if of_q else joint.num_velocities()
            start = joint._q_start if of_q else joint._v_start
            suffixes = joint._type.positions if of_q else joint._type.velocities
            before = f"{self._instance_name(joint)}_" if prefix else ""
            for k in range(count):
                after = f"_{suffixes[k]}" if always_add_suffix or count > 1 else ""
                names[start + k] = f"{before}{joint.name()}{after}"
        return list(names[self.indices(call, "q" if of_q else "v", model_instance)])

    @overloaded(
        overload(**_OF_ONE, **_SUFFIX),
        overload(lambda self, *flags: self._known_names("GetPositionNames", True, None, *flags), **_OF_ALL, **_SUFFIX),
    )
    def GetPositionNames(
        self, model_instance: ModelInstanceIndex, add_model_instance_prefix: bool, always_add_suffix: bool
    ) -> list[str]:
        """Names of the positions.

        Args:
            model_instance: Only those of one model instance; all when left out.
            add_model_instance_prefix: Begin names with that of the model instance; by default only when names of all
                instances are asked for.
            always_add_suffix: End names with what tells a joint's positions apart even when it has only one.
        """
        return self._known_names("GetPositionNames", True, model_instance, add_model_instance_prefix, always_add_suffix)

    @overloaded(
        overload(**_OF_ONE, **_SUFFIX),
        overload(lambda self, *flags: self._known_names("GetVelocityNames", False, None, *flags), **_OF_ALL, **_SUFFIX),
    )
    def GetVelocityNames(
        self, model_instance: ModelInstanceIndex, add_model_instance_prefix: bool, always_add_suffix: bool
    ) -> list[str]:
        """Names of the velocities; arguments as in GetPositionNames()."""
        return self._known_names(
            "GetVelocityNames", False, model_instance, add_model_instance_prefix, always_add_suffix
        )

    @overloaded(overload(**_OF_ONE), overload(lambda self, prefix: self._state_names(None, prefix), **_OF_ALL))
    def GetStateNames(self, model_instance: ModelInstanceIndex, add_model_instance_prefix: bool) -> list[str]:
        """Names of the positions, then of the velocities; arguments as in GetPositionNames()."""
        return self._state_names(model_instance, add_model_instance_prefix)

    def _state_names(self, model_instance: ModelInstanceIndex | None, prefix: bool) -> list[str]:
        how = model_instance, prefix, True
        return self._known_names("GetStateNames", True, *how) + self._known_names("GetStateNames", False, *how)

    @overloaded(
        overload(**_OF_ONE),
        overload(lambda self, prefix: self._known_names("GetActuatorNames", None, prefix), **_OF_ALL),
    )
    def GetActuatorNames(self, model_instance: ModelInstanceIndex, add_model_instance_prefix: bool) -> list[str]:
        """Names of the actuators, in the order of the actuation vector."""
        return self._known_names("GetActuatorNames", model_instance, add_model_instance_prefix)

    def _new_actuator_names(self, call: str, model_instance: ModelInstanceIndex | None, prefix: bool) -> list[str]:
        self._elements.require_finalized(call)
        return [
            f"{self._instance_name(a)}_{a.name()}" if prefix else a.name()
            for a in self.actuators_of(call, model_instance)
        ]

    def _instance_name(self, element: Joint | JointActuator) -> str:
        return self._elements.GetModelInstanceName(element.model_instance())

    # --- limits

    def _limits(self, call: str, kind: str, side: int) -> np.ndarray:
        """Lower (0) or upper (1) limits of all joints.

        Args:
            call: For the error before Finalize().
            kind: "position", "velocity" or "acceleration".
            side: 0 or 1.
        """
        model = self._elements.model(call)
        if self._limits_changed != Joint.limits_changed:
            self._limits_of_joints.clear()
            self._limits_changed = Joint.limits_changed
        limits = self._limits_of_joints.get((kind, side))
        if limits is None:
            limits = np.concatenate([np.zeros(0), *(j._limits[kind][side] for j in model.joints_by_coordinate)])
            limits.flags.writeable = False  # copies of the plant share them
            self._limits_of_joints[kind, side] = limits
        return limits.copy()

    def _effort_limits(self, call: str) -> np.ndarray:
        """Upper limits of the efforts, shape (nu,)."""
        return np.array([a._effort_limit for a in self._elements.model(call).actuators for _ in range(a.num_inputs())])

    def GetPositionLowerLimits(self) -> np.ndarray:
        """Lower limits of the positions, shape (nq,)."""
        return self._limits("GetPositionLowerLimits", "position", 0)

    def GetPositionUpperLimits(self) -> np.ndarray:
        """Upper limits of the positions, shape (nq,)."""
        return self._limits("GetPositionUpperLimits", "position", 1)

    def GetVelocityLowerLimits(self) -> np.ndarray:
        """Lower limits of the velocities, shape (nv,)."""
        return self._limits("GetVelocityLowerLimits", "velocity", 0)

    def GetVelocityUpperLimits(self) -> np.ndarray:
        """Upper limits of the velocities, shape (nv,)."""
        return self._limits("GetVelocityUpperLimits", "velocity", 1)

    def GetAccelerationLowerLimits(self) -> np.ndarray:
        """Lower limits of the accelerations, shape (nv,)."""
        return self._limits("GetAccelerationLowerLimits", "acceleration", 0)

    def GetAccelerationUpperLimits(self) -> np.ndarray:
        """Upper limits of the accelerations, shape (nv,)."""
        return self._limits("GetAccelerationUpperLimits", "acceleration", 1)

    def GetEffortLowerLimits(self) -> np.ndarray:
        """Lower limits of the efforts, shape (num_actuated_dofs,)."""
        return -self._effort_limits("GetEffortLowerLimits")

    def GetEffortUpperLimits(self) -> np.ndarray:
        """Upper limits of the efforts, shape (num_actuated_dofs,)."""
        return self._effort_limits("GetEffortUpperLimits")

    # --- state in a context

    def _part(self, call: str, which: str, array: np.ndarray, model_instance: ModelInstanceIndex | None) -> np.ndarray:
        """A copy of positions ("q") or velocities ("v"): of all of them, or of those of one model instance."""
        return array.copy() if model_instance is None else array[self.indices(call, which, model_instance)]

    def GetPositions(self, context: Context, model_instance: ModelInstanceIndex | None = None) -> np.ndarray:
        """Positions, shape (nq,), of all or of one model instance."""
        return self._part("GetPositions", "q", self._contexts.view(context).q, model_instance)

    def GetVelocities(self, context: Context, model_instance: ModelInstanceIndex | None = None) -> np.ndarray:
        """Velocities, shape (nv,), of all or of one model instance."""
        return self._part("GetVelocities", "v", self._contexts.view(context).v, model_instance)

    def GetPositionsAndVelocities(
        self, context: Context, model_instance: ModelInstanceIndex | None = None
    ) -> np.ndarray:
        """Positions, then velocities, shape (nq + nv,), of all or of one model instance."""
        view = self._contexts.view(context)
        if model_instance is None:
            return view.x.copy()
        return view.x[self.state_indices("GetPositionsAndVelocities", model_instance)]

    def _with_part(self, view: View, parts: str, instance: object, values: object, *rest: object) -> np.ndarray | None:
        """All positions or velocities with others for a model instance; None where that is for `_write` to say."""
        if rest or type(instance) is not ModelInstanceIndex or type(values) is not np.ndarray:
            return None
        at = self._of_instance.get((parts, int(instance)))
        if at is None or view.T is not float or values.shape != at.shape or values.dtype != float:
            return None
        whole = (view.q if parts == "q" else view.v if parts == "v" else view.x).copy()
        whole[at] = values
        return whole

    def _write(self, call: str, context: Context, parts: str, args: tuple, kwargs: dict[str, Any]) -> None:
        """Sets positions ("q"), velocities ("v") or both ("qv").

        Args:
            call: For errors.
            context: Where.
            parts: Which.
            args: `[model_instance], values`.
            kwargs: The same by name.
        """
        rest = [a for a in args if a is not None]
        instance = kwargs.pop("model_instance", None)
        if len(rest) == 2 or (rest and isinstance(rest[0], ModelInstanceIndex)):
            instance = rest.pop(0)
        values = rest.pop(0) if rest else kwargs.pop(_NAMES[parts], None)
        if rest or kwargs or values is None or not (instance is None or isinstance(instance, ModelInstanceIndex)):
            raise Mismatch(
                f"{call}(): incompatible function arguments. Takes (context, values) or (context, model_instance, "
                "values)."
            )
        view = self._contexts.view(context)
        at: list[Any]
        if instance is None:
            sizes, at = [view.nq if which == "q" else view.nv for which in parts], [slice(None)] * len(parts)
        else:
            at = [self.indices(call, which, instance) for which in parts]
            if parts == "qv":
                self.state_indices(call, instance)  # for the quick way, next time
            sizes = [len(numbers) for numbers in at]
        size = sum(sizes)
        array = np.asarray(values)
        array = array.reshape(-1) if array.ndim == 2 and 1 in array.shape else array
        if array.ndim == 0 or array.dtype.kind not in "fiubO":
            raise Mismatch(
                f"{call}(): incompatible function arguments. Takes a vector of {size} numbers, not {values!r}."
            )
        if array.shape != (size,):
            whose = (
                "the plant"
                if instance is None
                else f"model instance '{self._elements.instances.get(instance, call).name()}'"
            )
            raise RuntimeError(
                f"{call}(): {whose} has {size} {_WORDS[parts]}, but the given array has shape {array.shape}."
            )
        finite(call, "the values", array)
        array = lifted(array, view.T)
        context._store.check_thread()
        if "q" in parts:
            view.q[at[0]] = array[: sizes[0]]
        if "v" in parts:
            view.v[at[-1]] = array[size - sizes[-1] :]
        self._contexts.wrote(context, view)

    SetPositions = _setter("SetPositions", "q", "write_q")
    SetVelocities = _setter("SetVelocities", "v", "write_v")
    SetPositionsAndVelocities = _setter("SetPositionsAndVelocities", "qv", "write_x")

    @checked
    def GetPositionsFromArray(self, model_instance: ModelInstanceIndex, q: ArrayLike) -> np.ndarray:
        """The positions of a model instance among all."""
        at = self.indices("GetPositionsFromArray", "q", model_instance)
        return _of_size("q", q, self._model.nq)[at]

    @checked
    def GetVelocitiesFromArray(self, model_instance: ModelInstanceIndex, v: ArrayLike) -> np.ndarray:
        """The velocities of a model instance among all."""
        at = self.indices("GetVelocitiesFromArray", "v", model_instance)
        return _of_size("v", v, self._model.nv)[at]

    @checked
    def SetPositionsInArray(self, model_instance: ModelInstanceIndex, q_instance: ArrayLike, q: np.ndarray) -> None:
        """Writes the positions of a model instance into an array of all, in place."""
        at = self.indices("SetPositionsInArray", "q", model_instance)
        _set_in_array(writable("SetPositionsInArray", "q", q), "q", self._model.nq, at, q_instance)

    @checked
    def SetVelocitiesInArray(self, model_instance: ModelInstanceIndex, v_instance: ArrayLike, v: np.ndarray) -> None:
        """Writes the velocities of a model instance into an array of all, in place."""
        at = self.indices("SetVelocitiesInArray", "v", model_instance)
        _set_in_array(writable("SetVelocitiesInArray", "v", v), "v", self._model.nv, at, v_instance)

    @checked
    def GetActuationFromArray(self, model_instance: ModelInstanceIndex, u: ArrayLike) -> np.ndarray:
        """The actuation of a model instance among all."""
        at = self.input_indices("GetActuationFromArray", model_instance)
        return _of_size("u", u, self._model.nu)[at]

    @checked
    def SetActuationInArray(self, model_instance: ModelInstanceIndex, u_instance: ArrayLike, u: np.ndarray) -> None:
        """Writes the actuation of a model instance into an array of all, in place."""
        at = self.input_indices("SetActuationInArray", model_instance)
        _set_in_array(writable("SetActuationInArray", "u", u), "u", self._model.nu, at, u_instance)

    # --- defaults

    def GetDefaultPositions(self, model_instance: ModelInstanceIndex | None = None) -> np.ndarray:
        """Positions of a default context, shape (nq,), of all or of one model instance."""
        positions = self._elements.model("GetDefaultPositions").default_positions()
        if model_instance is not None:
            positions = positions[self.indices("GetDefaultPositions", "q", model_instance)]
        return lifted(positions, self._contexts.scalar)

    @checked
    def SetDefaultPositions(
        self,
        *args: ArrayLike,
        q: ArrayLike | None = None,
        model_instance: ModelInstanceIndex | None = None,
        q_instance: ArrayLike | None = None,
    ) -> None:
        """Sets positions of default contexts: `(q)` all, `(model_instance, q_instance)` those of one model instance."""
        rest: list[Any] = list(args)
        if len(rest) == 2:
            model_instance = rest.pop(0)
        values = rest.pop(0) if rest else (q if q is not None else q_instance)
        call = "SetDefaultPositions"
        at = self.indices(call, "q", model_instance)
        array = np.ravel(np.asarray(values, float))
        if array.shape != at.shape:
            raise RuntimeError(f"{call}(): expected {len(at)} positions, but the given array has {array.size}.")
        model = self._model
        new = model.default_positions()
        new[at] = finite(call, "the positions", array)
        for joint in model.joints_by_coordinate:
            joint._default_q = new[joint._q_start : joint._q_start + len(joint._default_q)]  # nobody else has it

    # --- selectors

    @checked
    def MakeStateSelectorMatrix(self, user_to_joint_index_map: Sequence[JointIndex]) -> np.ndarray:
        """S with x_selected = S x: positions, then velocities of the given joints; shape (n, nq + nv).

        Raises:
            RuntimeError: a joint is given twice.
        """
        model = self._elements.model("MakeStateSelectorMatrix")
        joints = [self._elements.joints.get(i, "get_joint") for i in user_to_joint_index_map]
        for i, joint in enumerate(joints):
            if joint in joints[:i]:
                raise RuntimeError(f"Joint named '{joint.name()}' is repeated multiple times.")
        q = [j._q_start + k for j in joints for k in range(j.num_positions())]
        v = [model.nq + j._v_start + k for j in joints for k in range(j.num_velocities())]
        return np.eye(model.nq + model.nv)[[*q, *v]].reshape(-1, model.nq + model.nv)

    def MakeActuatorSelectorMatrix(
        self,
        user_to_actuator_index_map: Any = None,
        *,
        user_to_joint_index_map: Any = None,
    ) -> np.ndarray:
        """S with u = S u_selected, for a list of actuators or of joints; shape (num_actuated_dofs, n)."""
        model = self._elements.model("MakeActuatorSelectorMatrix")
        chosen = user_to_joint_index_map if user_to_actuator_index_map is None else user_to_actuator_index_map
        S = np.zeros((model.nu, len(chosen)))
        for column, index in enumerate(chosen):
            if type(index).__name__ == "JointIndex" or user_to_joint_index_map is not None:
                joint = self._elements.joints.get(index, "get_joint")
                actuator = next((a for a in model.actuators if a.joint() is joint), None)
                if actuator is None:
                    raise RuntimeError(f"MakeActuatorSelectorMatrix(): joint {joint.name()!r} has no actuator.")
            else:
                actuator = self._elements.actuators.get(index, "get_joint_actuator")
            S[actuator._input_start, column] = 1.0
        return S

    def actuation_matrix(self, call: str) -> np.ndarray:
        """The numbers of B, to be read only."""
        if self._actuation_matrix is None:
            model = self._elements.model(call)
            B = np.zeros((model.nv, model.nu))
            for a in model.actuators:
                B[a.joint()._v_start, a._input_start] = 1.0
            self._actuation_matrix = B
        return self._actuation_matrix

    def MakeActuationMatrix(self) -> np.ndarray:
        """B with generalized forces = B u, of the plant's scalar; shape (nv, num_actuated_dofs)."""
        B, scalar = self.actuation_matrix("MakeActuationMatrix"), self._contexts.scalar
        return B.copy() if scalar is float else lifted(B.ravel(), scalar).reshape(B.shape)

    def MakeActuationMatrixPseudoinverse(self) -> csc_matrix:
        """B⁺ with u = B⁺ tau, a scipy.sparse.csc_matrix; shape (num_actuated_dofs, nv)."""
        return sparse(self.actuation_matrix("MakeActuationMatrixPseudoinverse"))


def sparse(columns: np.ndarray) -> csc_matrix:
    """A matrix given by its columns, without the zeros among them."""
    from scipy.sparse import csc_matrix

    if columns.dtype == object:
        return csc_matrix(columns.T)
    column, row = columns.nonzero()
    ends = np.searchsorted(column, np.arange(len(columns) + 1))
    indices = row.astype(np.int32), ends.astype(np.int32)  # which SciPy takes as they are
    return csc_matrix((columns[column, row], *indices), columns.T.shape)


def _set_in_array(whole: np.ndarray, name: str, size: int, at: np.ndarray, part: ArrayLike) -> None:
    """Writes numbers of a model instance into an array of all, in place."""
    _of_size(name, whole, size)
    numbers = _of_size(f"{name}_instance", part, len(at))
    whole[at] = numbers if np.ndim(whole) == 1 else numbers.reshape(np.shape(whole[at]))


def _of_size(name: str, values: ArrayLike, size: int) -> np.ndarray:
    """The numbers, as an array, to be read only.

    Raises:
        RuntimeError: there are more or fewer than `size`.
    """
    if type(values) is np.ndarray and values.dtype == float and values.shape == (size,):
        return values
    if np.size(values) != size:
        raise RuntimeError(f"Passed in array is not properly sized: {name} has {np.size(values)} numbers, not {size}.")
    return vector("MultibodyPlant", name, values, size)
