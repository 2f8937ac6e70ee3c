"""How a plant reads and writes contexts, and what it keeps computed for one."""

from __future__ import annotations

from typing import Any

import numpy as np

from sheldrake.math import RigidTransform_
from sheldrake.multibody.math import SpatialInertia_, UnitInertia_
from sheldrake.multibody.plant._context.view import View
from sheldrake.systems.framework._vector import lifted, plain


class ContextAccess:
    """Reading and writing contexts."""

    def _view(self, context: Any) -> View:
        """The view of a context, after checking that it is one of this plant.

        Raises:
            RuntimeError: the context belongs to another system, or the plant is not finalized.
        """
        try:
            view = context._kept
            if view.family is self._family:
                return view
        except AttributeError:
            pass
        return self._new_view(context)

    def _new_view(self, context: Any) -> View:
        system = getattr(context, "_system", None)
        if system is None:
            self.ValidateContext(context)  # It is none at all.
        if system is not self and getattr(system, "_family", None) is not self._family:
            self._require_finalized("ValidateContext")
            self.ValidateContext(context)
        store = context._store
        views = store.__dict__.setdefault("_plant_views", {})
        view = views.get(context._node)
        if view is None or view.S is not store.S:
            view = views[context._node] = View(self, context)
        context._kept = view
        return view

    def _positions(self, context: Any) -> np.ndarray:
        return self._view(context).q

    def _velocities(self, context: Any) -> np.ndarray:
        return self._view(context).v

    def _write_positions(self, context: Any, start: int, values: Any) -> None:
        view = self._view(context)
        view.q[start : start + len(values)] = values if view.T is float else lifted(np.asarray(values), view.T)
        context._store.touch(view.level, view.source)

    def _write_velocities(self, context: Any, start: int, values: Any) -> None:
        view = self._view(context)
        view.v[start : start + len(values)] = values if view.T is float else lifted(np.asarray(values), view.T)
        context._store.touch(view.level, view.source)

    def _numbers(self, context: Any, group: int) -> np.ndarray:
        start = self._parameter_starts[group]
        return self._view(context).p[start : start + len(self._parameter_models[group])]

    def _write_numbers(self, context: Any, group: int, values: Any) -> None:
        self._view(context)
        context.get_mutable_numeric_parameter(group).SetFromVector(values)

    def _is_locked(self, context: Any, joint: Any) -> bool:
        return bool(plain(self._numbers(context, self._lock_group)[int(joint.index())]))

    def _set_locked(self, context: Any, joint: Any, locked: bool) -> None:
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
