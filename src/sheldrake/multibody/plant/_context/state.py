"""Positions, velocities and state of a plant: numbers, names, limits, defaults, free bodies."""

from __future__ import annotations

import operator
from collections.abc import Callable
from typing import Any

import numpy as np

from sheldrake.multibody.tree import ModelInstanceIndex
from sheldrake.multibody.tree._element import finite, vector
from sheldrake.systems.framework._vector import lifted

_NAMES = {"q": "q", "v": "v", "qv": "q_v"}
_WORDS = {"q": "positions", "v": "velocities", "qv": "positions and velocities"}


def _setter(call: str, parts: str, quick: str) -> Callable[..., None]:
    """A method that sets positions, velocities or both; its quick way asks the view's builtin function `quick`."""
    writer = operator.attrgetter(quick)

    def set_values(self: Any, context: Any, values: Any = None, *rest: Any, **named: Any) -> None:
        try:  # the one that has to be quick
            view = context._kept
            if view.family is self._family and not (rest or named or writer(view)(values)):
                return
        except AttributeError:
            pass
        self._write(call, context, parts, (values, *rest), named)

    set_values.__name__, set_values.__qualname__ = call, f"MultibodyPlant.{call}"
    set_values.__doc__ = f"""Sets {_WORDS[parts]}: those of all, or of one model instance.

        Called as `(context, {_NAMES[parts]})` or `(context, model_instance, {_NAMES[parts]})`.

        Raises:
            RuntimeError: the size is wrong or a number is not finite.
        """
    return set_values


class State:
    """How many positions and velocities there are, what they are called, and reading and writing them."""

    # --- counts

    def _joints_of(self, call: str, model_instance: Any) -> list[Any]:
        self._require_finalized(call)
        if model_instance is None:
            return list(self._joints)
        self._instances.get(model_instance, call)
        return self._joints.of_instance(model_instance)

    def _indices(self, call: str, model_instance: Any, which: str) -> np.ndarray:
        """Numbers of the positions ("q") or velocities ("v") of a model instance, ascending; all for None."""
        self._require_finalized(call)
        if model_instance is None:
            return np.arange(self._nq if which == "q" else self._nv)
        self._instances.get(model_instance, call)
        key = which, int(model_instance)
        if key not in self._index_cache:
            numbers = [
                n
                for j in self._joints.of_instance(model_instance)
                for n in (
                    range(j._q_start, j._q_start + j.num_positions())
                    if which == "q"
                    else range(j._v_start, j._v_start + j.num_velocities())
                )
            ]
            self._index_cache[key] = np.array(sorted(numbers), np.int64)
        return self._index_cache[key]

    def num_positions(self, model_instance: ModelInstanceIndex | None = None) -> int:
        """Number of positions, of all or of one model instance."""
        return len(self._indices("num_positions", model_instance, "q"))

    def num_velocities(self, model_instance: ModelInstanceIndex | None = None) -> int:
        """Number of velocities, of all or of one model instance."""
        return len(self._indices("num_velocities", model_instance, "v"))

    def num_multibody_states(self, model_instance: ModelInstanceIndex | None = None) -> int:
        """Number of positions and velocities, of all or of one model instance."""
        call = "num_multibody_states"
        return len(self._indices(call, model_instance, "q")) + len(self._indices(call, model_instance, "v"))

    def _actuators_of(self, model_instance: Any) -> list[Any]:
        return list(self._actuators) if model_instance is None else self._actuators.of_instance(model_instance)

    def num_actuators(self, model_instance: ModelInstanceIndex | None = None) -> int:
        """Number of actuators, of all or of one model instance."""
        if model_instance is not None:
            self._require_finalized("num_actuators")
            self._instances.get(model_instance, "num_actuators")
        return len(self._actuators_of(model_instance))

    def num_actuated_dofs(self, model_instance: ModelInstanceIndex | None = None) -> int:
        """Number of velocities with actuators, of all or of one model instance."""
        if model_instance is not None:
            self._require_finalized("num_actuated_dofs")
            self._instances.get(model_instance, "num_actuated_dofs")
        return sum(a.num_inputs() for a in self._actuators_of(model_instance))

    def _input_indices(self, call: str, model_instance: Any) -> np.ndarray:
        """Numbers of the inputs of a model instance in the actuation vector."""
        self._require_finalized(call)
        if model_instance is not None:
            self._instances.get(model_instance, call)
        return np.array(
            [a._input_start + k for a in self._actuators_of(model_instance) for k in range(a.num_inputs())], np.int64
        )

    # --- names

    def _element_names(
        self, call: str, which: str, args: tuple, always_add_suffix: bool, add_model_instance_prefix: bool | None
    ) -> list[str]:
        instance, flags = None, list(args)
        if flags and isinstance(flags[0], ModelInstanceIndex):
            instance = flags.pop(0)
        prefix = flags.pop(0) if flags else add_model_instance_prefix
        always_add_suffix = flags.pop(0) if flags else always_add_suffix
        prefix = (instance is None) if prefix is None else prefix
        self._require_finalized(call)
        names: Any = np.empty(self._nq if which == "q" else self._nv, dtype=object)
        for joint in self._joints:
            count = joint.num_positions() if which == "q" else joint.num_velocities()
            start = joint._q_start if which == "q" else joint._v_start
            suffixes = joint._q_suffixes if which == "q" else joint._v_suffixes
            before = f"{self.GetModelInstanceName(joint.model_instance())}_" if prefix else ""
            for k in range(count):
                after = f"_{suffixes[k]}" if always_add_suffix or count > 1 else ""
                names[start + k] = f"{before}{joint.name()}{after}"
        return list(names[self._indices(call, instance, which)])

    def GetPositionNames(
        self,
        *args: Any,
        model_instance: Any = None,
        add_model_instance_prefix: bool | None = None,
        always_add_suffix: bool = True,
    ) -> list[str]:
        """Names of the positions.

        Args:
            args: `[model_instance], [add_model_instance_prefix], [always_add_suffix]`.
            model_instance: Only those of one model instance.
            add_model_instance_prefix: Begin names with that of the model instance; by default only when names of all
                instances are asked for.
            always_add_suffix: End names with what tells a joint's positions apart even when it has only one.
        """
        args = args if model_instance is None else (model_instance, *args)
        return self._element_names("GetPositionNames", "q", args, always_add_suffix, add_model_instance_prefix)

    def GetVelocityNames(
        self,
        *args: Any,
        model_instance: Any = None,
        add_model_instance_prefix: bool | None = None,
        always_add_suffix: bool = True,
    ) -> list[str]:
        """Names of the velocities; arguments as in GetPositionNames()."""
        args = args if model_instance is None else (model_instance, *args)
        return self._element_names("GetVelocityNames", "v", args, always_add_suffix, add_model_instance_prefix)

    def GetStateNames(
        self, *args: Any, model_instance: Any = None, add_model_instance_prefix: bool | None = None
    ) -> list[str]:
        """Names of the positions, then of the velocities; arguments as in GetPositionNames()."""
        args = args if model_instance is None else (model_instance, *args)
        return [
            *self._element_names("GetStateNames", "q", args, True, add_model_instance_prefix),
            *self._element_names("GetStateNames", "v", args, True, add_model_instance_prefix),
        ]

    def GetActuatorNames(
        self, *args: Any, model_instance: Any = None, add_model_instance_prefix: bool | None = None
    ) -> list[str]:
        """Names of the actuators, in the order of the actuation vector."""
        self._require_finalized("GetActuatorNames")
        flags, instance = list(args), model_instance
        if flags and isinstance(flags[0], ModelInstanceIndex):
            instance = flags.pop(0)
        prefix = flags.pop(0) if flags else add_model_instance_prefix
        prefix = (instance is None) if prefix is None else prefix
        return [
            f"{self.GetModelInstanceName(a.model_instance())}_{a.name()}" if prefix else a.name()
            for a in self._actuators_of(instance)
        ]

    # --- limits

    def _limit_vector(self, call: str, kind: str, side: int) -> np.ndarray:
        self._require_finalized(call)
        out = np.empty(self._nq if kind == "position" else self._nv)
        for joint in self._joints:
            values = joint._limits[kind][side]
            start = joint._q_start if kind == "position" else joint._v_start
            out[start : start + len(values)] = values
        return out

    def GetPositionLowerLimits(self) -> np.ndarray:
        """Lower limits of the positions, shape (nq,)."""
        return self._limit_vector("GetPositionLowerLimits", "position", 0)

    def GetPositionUpperLimits(self) -> np.ndarray:
        """Upper limits of the positions, shape (nq,)."""
        return self._limit_vector("GetPositionUpperLimits", "position", 1)

    def GetVelocityLowerLimits(self) -> np.ndarray:
        """Lower limits of the velocities, shape (nv,)."""
        return self._limit_vector("GetVelocityLowerLimits", "velocity", 0)

    def GetVelocityUpperLimits(self) -> np.ndarray:
        """Upper limits of the velocities, shape (nv,)."""
        return self._limit_vector("GetVelocityUpperLimits", "velocity", 1)

    def GetAccelerationLowerLimits(self) -> np.ndarray:
        """Lower limits of the accelerations, shape (nv,)."""
        return self._limit_vector("GetAccelerationLowerLimits", "acceleration", 0)

    def GetAccelerationUpperLimits(self) -> np.ndarray:
        """Upper limits of the accelerations, shape (nv,)."""
        return self._limit_vector("GetAccelerationUpperLimits", "acceleration", 1)

    def GetEffortLowerLimits(self) -> np.ndarray:
        """Lower limits of the efforts, shape (num_actuated_dofs,)."""
        self._require_finalized("GetEffortLowerLimits")
        return -self.GetEffortUpperLimits()

    def GetEffortUpperLimits(self) -> np.ndarray:
        """Upper limits of the efforts, shape (num_actuated_dofs,)."""
        self._require_finalized("GetEffortUpperLimits")
        return np.array([a.effort_limit() for a in self._actuators for _ in range(a.num_inputs())])

    # --- state in a context

    def _sub(self, call: str, array: np.ndarray, model_instance: Any, which: str) -> np.ndarray:
        if model_instance is None:
            return array.copy()
        return array[self._indices(call, model_instance, which)]

    def GetPositions(self, context: Any, model_instance: ModelInstanceIndex | None = None) -> np.ndarray:
        """Positions, shape (nq,), of all or of one model instance."""
        return self._sub("GetPositions", self._view(context).q, model_instance, "q")

    def GetVelocities(self, context: Any, model_instance: ModelInstanceIndex | None = None) -> np.ndarray:
        """Velocities, shape (nv,), of all or of one model instance."""
        return self._sub("GetVelocities", self._view(context).v, model_instance, "v")

    def GetPositionsAndVelocities(self, context: Any, model_instance: ModelInstanceIndex | None = None) -> np.ndarray:
        """Positions, then velocities, shape (nq + nv,), of all or of one model instance."""
        view, call = self._view(context), "GetPositionsAndVelocities"
        if model_instance is None:
            return view.x.copy()
        return np.concatenate(
            [self._sub(call, view.q, model_instance, "q"), self._sub(call, view.v, model_instance, "v")]
        )

    def _write(self, call: str, context: Any, parts: str, args: tuple, kwargs: dict[str, Any]) -> None:
        """`args` is ([model_instance], values); kwargs may name both."""
        rest = [a for a in args if a is not None]
        instance = kwargs.pop("model_instance", None)
        if len(rest) == 2 or (rest and isinstance(rest[0], ModelInstanceIndex)):
            instance = rest.pop(0)
        values = rest.pop(0) if rest else kwargs.pop(_NAMES[parts], None)
        if rest or kwargs or values is None or not (instance is None or isinstance(instance, ModelInstanceIndex)):
            raise TypeError(
                f"{call}(): incompatible function arguments. Takes (context, values) or (context, model_instance, "
                "values)."
            )
        view = self._view(context)
        at = [self._indices(call, instance, which) for which in parts]
        size = sum(len(a) for a in at)
        array = np.asarray(values)
        array = array.reshape(-1) if array.ndim == 2 and 1 in array.shape else array
        if array.ndim == 0 or array.dtype.kind not in "fiubO":
            raise TypeError(
                f"{call}(): incompatible function arguments. Takes a vector of {size} numbers, not {values!r}."
            )
        if array.shape != (size,):
            whose = "the plant" if instance is None else f"model instance '{self.GetModelInstanceName(instance)}'"
            raise RuntimeError(
                f"{call}(): {whose} has {size} {_WORDS[parts]}, but the given array has shape {array.shape}."
            )
        finite(call, "the values", array)
        if "q" in parts:
            view.q[at[0]] = array[: len(at[0])]
        if "v" in parts:
            view.v[at[-1]] = array[size - len(at[-1]) :]
        context._store.touch(view.level, view.source)

    SetPositions = _setter("SetPositions", "q", "write_q")
    SetVelocities = _setter("SetVelocities", "v", "write_v")
    SetPositionsAndVelocities = _setter("SetPositionsAndVelocities", "qv", "write_x")

    def GetPositionsFromArray(self, model_instance: ModelInstanceIndex, q: Any) -> np.ndarray:
        """The positions of a model instance among all."""
        return _of_size("q", q, self._nq)[self._indices("GetPositionsFromArray", model_instance, "q")]

    def GetVelocitiesFromArray(self, model_instance: ModelInstanceIndex, v: Any) -> np.ndarray:
        """The velocities of a model instance among all."""
        return _of_size("v", v, self._nv)[self._indices("GetVelocitiesFromArray", model_instance, "v")]

    def SetPositionsInArray(self, model_instance: ModelInstanceIndex, q_instance: Any, q: np.ndarray) -> None:
        """Writes the positions of a model instance into an array of all, in place."""
        at = self._indices("SetPositionsInArray", model_instance, "q")
        _of_size("q", q, self._nq)
        q[at] = _of_size("q_instance", q_instance, len(at))

    def SetVelocitiesInArray(self, model_instance: ModelInstanceIndex, v_instance: Any, v: np.ndarray) -> None:
        """Writes the velocities of a model instance into an array of all, in place."""
        at = self._indices("SetVelocitiesInArray", model_instance, "v")
        _of_size("v", v, self._nv)
        v[at] = _of_size("v_instance", v_instance, len(at))

    def GetActuationFromArray(self, model_instance: ModelInstanceIndex, u: Any) -> np.ndarray:
        """The actuation of a model instance among all."""
        at = self._input_indices("GetActuationFromArray", model_instance)
        return _of_size("u", u, self._nu)[at]

    def SetActuationInArray(self, model_instance: ModelInstanceIndex, u_instance: Any, u: np.ndarray) -> None:
        """Writes the actuation of a model instance into an array of all, in place."""
        at = self._input_indices("SetActuationInArray", model_instance)
        _of_size("u", u, self._nu)
        u[at] = _of_size("u_instance", u_instance, len(at))

    # --- defaults

    def GetDefaultPositions(self, model_instance: ModelInstanceIndex | None = None) -> np.ndarray:
        """Positions of a default context, shape (nq,), of all or of one model instance."""
        at = self._indices("GetDefaultPositions", model_instance, "q")
        return lifted(self._all_default_positions()[at], self._scalar)

    def _all_default_positions(self) -> np.ndarray:
        q = np.zeros(self._nq)
        for joint in self._joints:
            q[joint._q_start : joint._q_start + joint.num_positions()] = joint._default_q
        return q

    def SetDefaultPositions(
        self, *args: Any, q: Any = None, model_instance: Any = None, q_instance: Any = None
    ) -> None:
        """Sets positions of default contexts: `(q)` all, `(model_instance, q_instance)` those of one model instance."""
        rest = list(args)
        if len(rest) == 2:
            model_instance = rest.pop(0)
        values = rest.pop(0) if rest else (q if q is not None else q_instance)
        call = "SetDefaultPositions"
        at = self._indices(call, model_instance, "q")
        array = np.ravel(np.asarray(values, float))
        if array.shape != at.shape:
            raise RuntimeError(f"{call}(): expected {len(at)} positions, but the given array has {array.size}.")
        new = self._all_default_positions()
        new[at] = array
        for joint in self._joints:
            joint._default_q = new[joint._q_start : joint._q_start + joint.num_positions()].copy()

    # --- selectors

    def MakeStateSelectorMatrix(self, user_to_joint_index_map: list[Any]) -> np.ndarray:
        """S with x_selected = S x: positions, then velocities of the given joints; shape (n, nq + nv).

        Raises:
            RuntimeError: a joint is given twice.
        """
        self._require_finalized("MakeStateSelectorMatrix")
        joints = [self.get_joint(i) for i in user_to_joint_index_map]
        for i, joint in enumerate(joints):
            if joint in joints[:i]:
                raise RuntimeError(f"Joint named '{joint.name()}' is repeated multiple times.")
        q = [j._q_start + k for j in joints for k in range(j.num_positions())]
        v = [self._nq + j._v_start + k for j in joints for k in range(j.num_velocities())]
        return np.eye(self._nq + self._nv)[[*q, *v]].reshape(-1, self._nq + self._nv)

    def MakeActuatorSelectorMatrix(
        self, user_to_actuator_index_map: Any = None, *, user_to_joint_index_map: Any = None
    ) -> np.ndarray:
        """S with u = S u_selected, for a list of actuators or of joints; shape (num_actuated_dofs, n)."""
        self._require_finalized("MakeActuatorSelectorMatrix")
        chosen = user_to_joint_index_map if user_to_actuator_index_map is None else user_to_actuator_index_map
        S = np.zeros((self._nu, len(chosen)))
        for column, index in enumerate(chosen):
            if type(index).__name__ == "JointIndex" or user_to_joint_index_map is not None:
                joint = self.get_joint(index)
                actuator = next((a for a in self._actuators if a.joint() is joint), None)
                if actuator is None:
                    raise RuntimeError(f"MakeActuatorSelectorMatrix(): joint {joint.name()!r} has no actuator.")
            else:
                actuator = self.get_joint_actuator(index)
            S[actuator._input_start, column] = 1.0
        return S

    def MakeActuationMatrix(self) -> np.ndarray:
        """B with generalized forces = B u; shape (nv, num_actuated_dofs)."""
        self._require_finalized("MakeActuationMatrix")
        B = np.zeros((self._nv, self._nu))
        for a in self._actuators:
            B[a.joint()._v_start, a._input_start] = 1.0
        return B

    def MakeActuationMatrixPseudoinverse(self) -> Any:
        """B⁺ with u = B⁺ tau, a scipy.sparse.csc_matrix; shape (num_actuated_dofs, nv)."""
        from scipy.sparse import csc_matrix

        return csc_matrix(self.MakeActuationMatrix().T)


def _of_size(name: str, values: Any, size: int) -> np.ndarray:
    """The numbers, as an array of its own.

    Raises:
        RuntimeError: there are more or fewer than `size`.
    """
    if np.size(values) != size:
        raise RuntimeError(f"Passed in array is not properly sized: {name} has {np.size(values)} numbers, not {size}.")
    return vector("MultibodyPlant", name, values, size)
