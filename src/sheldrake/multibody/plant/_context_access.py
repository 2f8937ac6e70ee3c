"""How a plant reads and writes contexts, and what it keeps computed for one."""

from __future__ import annotations

from typing import Any

import numpy as np

from sheldrake.common.chain import Chain
from sheldrake.math import RigidTransform_
from sheldrake.multibody.math import SpatialInertia_, UnitInertia_
from sheldrake.multibody.tree._kernels import model as tree_model
from sheldrake.multibody.tree._kernels import queries

_LEVEL_OF_DISCRETE, _LEVEL_OF_CONTINUOUS = 1, 2


class View:
    """One context of a plant as arrays: views of its memory, a workspace, and kernels bound to both.

    Stages are computed when asked for and kept until a source of the plant's state or parameters is written.
    """

    def __init__(self, plant: Any, context: Any):
        store, place = context._store, context._place
        state, p = slice(*(place.xd if plant.is_discrete() else place.xc)), slice(*place.p)
        self.S, self.counters = store.S, store.i
        self.level = _LEVEL_OF_DISCRETE if plant.is_discrete() else _LEVEL_OF_CONTINUOUS
        nq, nv = plant._nq, plant._nv
        x = store.S[state]
        self.x, self.q, self.v, self.p = x, x[:nq], x[nq : nq + nv], store.S[p]
        self.results: Any = None
        self.model, self.native = plant._tree_model, store.native
        self.work = tree_model.make_work(self.model, float if store.S.dtype == float else object)
        self.dtype = store.S.dtype
        self.stamp, self.done = -1, 0
        self.T, self.family = context._system._scalar, plant._family
        self._types: dict[Any, Any] = {}
        first = place.groups[0] if plant.is_discrete() else context._node
        self.source = ("xd", first) if plant.is_discrete() else ("xc", first)
        self.calls: dict[Any, Any] = {}
        self._buffers: dict[str, np.ndarray] = {}

    def zeros(self, *shape: int) -> np.ndarray:
        """An array of zeros of the context's scalar type."""
        return np.zeros(shape) if self.dtype == float else np.full(shape, 0.0, dtype=object)

    def buffer(self, name: str, *shape: int) -> np.ndarray:
        """An array that is always the same for this view, for kernels to read or fill."""
        array = self._buffers.get(name)
        if array is None:
            array = self._buffers[name] = self.zeros(*shape)
        return array

    def copy_of(self, work: Any) -> Any:
        """A workspace like `work`, of the context's scalar type."""
        if isinstance(work, np.ndarray):
            return work.copy() if work.dtype == np.int64 else work.astype(self.dtype)
        return type(work)(*(self.copy_of(part) for part in work))

    def integers(self, name: str, size: int) -> np.ndarray:
        """The same for integers."""
        array = self._buffers.get(name)
        if array is None:
            array = self._buffers[name] = np.zeros(size, np.int64)
        return array

    def run_chain(self, kernels: list[Any], **values: Any) -> int:
        """Runs kernels in turn on values by name; a status."""
        chain = Chain(kernels)
        return chain.native(**values) if self.native else chain(**values)

    def call(self, kernel: Any, *args: Any) -> int:
        """Runs a kernel on arrays that are new at each call."""
        return (kernel.native if self.native else kernel)(*args) or 0

    def bind(self, kernel: Any, *args: Any) -> Any:
        """A call of a kernel on arrays that are always the same for this view; kept in `calls`."""
        call = self.calls[kernel] = kernel.bind(*args) if self.native else lambda: kernel(*args)
        return call

    def run(self, kernel: Any, *args: Any) -> Any:
        """Runs a kernel on arrays that are always the same for this view."""
        return (self.calls.get(kernel) or self.bind(kernel, *args))()

    def of(self, family: Any) -> Any:
        """The class of a family for the context's scalar type."""
        cls = self._types.get(family)
        if cls is None:
            cls = self._types[family] = family[self.T]
        return cls

    def positions(self) -> Any:
        """The workspace with `X_WB`, `S` and `inertia`."""
        stamp = self.counters[self.level]
        if stamp != self.stamp or self.done < 1:
            kernel = queries.calc_positions
            (self.calls.get(kernel) or self.bind(kernel, self.model, self.p, self.work, self.q))()
            self.stamp, self.done = stamp, 1
        return self.work

    def velocities(self) -> Any:
        """The workspace with `V` and `A` too."""
        self.positions()
        if self.done < 2:
            kernel = queries.calc_velocities
            (self.calls.get(kernel) or self.bind(kernel, self.model, self.p, self.work, self.q, self.v))()
            self.done = 2
        return self.work


class ContextAccess:
    """Reading and writing contexts."""

    def _view(self, context: Any) -> View:
        """The view of a context, after checking that it is one of this plant.

        Raises:
            RuntimeError: the context belongs to another system, or the plant is not finalized.
        """
        try:
            store = context._store
            view = store._plant_views[context._node]
            if view.S is store.S and view.family is self._family:
                return view
        except (AttributeError, KeyError):
            pass
        return self._new_view(context)

    def _new_view(self, context: Any) -> View:
        system = getattr(context, "_system", None)
        if system is not self and getattr(system, "_family", None) is not self._family:
            self._require_finalized("ValidateContext")
            self.ValidateContext(context)
        store = context._store
        views = store.__dict__.get("_plant_views")
        if views is None:
            views = store._plant_views = {}
        view = views.get(context._node)
        if view is None or view.S is not store.S:
            view = views[context._node] = View(self, context)
        return view

    def _positions(self, context: Any) -> np.ndarray:
        return self._view(context).q

    def _velocities(self, context: Any) -> np.ndarray:
        return self._view(context).v

    def _write_positions(self, context: Any, start: int, values: Any) -> None:
        view = self._view(context)
        view.q[start : start + len(values)] = values
        context._store.touch(view.level, view.source)

    def _write_velocities(self, context: Any, start: int, values: Any) -> None:
        view = self._view(context)
        view.v[start : start + len(values)] = values
        context._store.touch(view.level, view.source)

    def _numbers(self, context: Any, group: int) -> np.ndarray:
        start = self._parameter_starts[group]
        return self._view(context).p[start : start + len(self._parameter_models[group])]

    def _write_numbers(self, context: Any, group: int, values: Any) -> None:
        self._view(context)
        context.get_mutable_numeric_parameter(group).SetFromVector(values)

    def _is_locked(self, context: Any, joint: Any) -> bool:
        return bool(self._numbers(context, self._lock_group)[int(joint.index())])

    def _set_locked(self, context: Any, joint: Any, locked: bool) -> None:
        if not self.is_discrete():
            raise RuntimeError(
                f"Joint {joint.name()!r} cannot be locked: joint locking is only supported for discrete plants "
                "(time_step > 0)."
            )
        flags = np.array(self._numbers(context, self._lock_group))
        flags[int(joint.index())] = float(locked)
        self._write_numbers(context, self._lock_group, flags)

    # --- numbers to objects

    def _transform(self, context: Any, numbers: Any) -> Any:
        """A RigidTransform, of the context's scalar, of twelve numbers: R row by row, then p."""
        make = self._view(context).of(RigidTransform_)._make
        return make(numbers[:9].reshape(3, 3).copy(), numbers[9:12].copy())

    def _spatial_inertia(self, context: Any, numbers: Any) -> Any:
        """A SpatialInertia, of the context's scalar, of the ten parameters of a body."""
        T = context._system._scalar
        mass, c, G = numbers[0], np.array(numbers[1:4]), UnitInertia_[T](*numbers[4:10])
        return SpatialInertia_[T](mass, c, G, skip_validity_check=True)
