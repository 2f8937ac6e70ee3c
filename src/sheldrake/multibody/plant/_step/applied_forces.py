"""Forces from outside that come as a list of objects: these take the plant's step through Python.

A kernel does not see abstract inputs. While the applied_spatial_force port is not used, steps and derivatives are
native rows. Once it is connected, exported or fixed, they are Python functions that turn the list into generalized
forces, put these into the step's scratch, and run the same kernel.
"""

from __future__ import annotations

import copy
import dataclasses
from typing import Any

import numpy as np

from sheldrake.common.value import _register_value_type
from sheldrake.multibody.math import SpatialForce
from sheldrake.multibody.plant._kernels.ports import (
    CONSTRAINTS_IN_CONTINUOUS_TIME,
    GEOMETRY_NOT_CONNECTED,
)
from sheldrake.multibody.tree import BodyIndex
from sheldrake.systems.framework import InputPort
from sheldrake.systems.framework._declarations import Callback, Stages


class ExternallyAppliedSpatialForce:
    """A force from outside on one body B at a point Bq fixed to it."""

    def __init__(self) -> None:
        self.body_index = BodyIndex()
        self.p_BoBq_B = np.zeros(3)
        self.F_Bq_W = SpatialForce(np.zeros(6))

    @property
    def body_index(self) -> BodyIndex:
        """The body."""
        return self._body_index

    @body_index.setter
    def body_index(self, value: Any) -> None:
        self._body_index = value if isinstance(value, BodyIndex) else BodyIndex(value)

    @property
    def p_BoBq_B(self) -> np.ndarray:
        """The point [m], shape (3,)."""
        return self._p_BoBq_B

    @p_BoBq_B.setter
    def p_BoBq_B(self, value: Any) -> None:
        array = np.asarray(value)
        self._p_BoBq_B = np.ravel(array.astype(float) if array.dtype != object else array).copy()

    def __copy__(self) -> ExternallyAppliedSpatialForce:
        new = ExternallyAppliedSpatialForce()
        new.body_index, new.p_BoBq_B, new.F_Bq_W = self.body_index, self.p_BoBq_B, self.F_Bq_W
        return new

    def __deepcopy__(self, memo: dict) -> ExternallyAppliedSpatialForce:
        new = copy.copy(self)
        new.F_Bq_W = copy.copy(self.F_Bq_W)
        return new

    def __repr__(self) -> str:
        return (
            f"ExternallyAppliedSpatialForce(body_index={self.body_index!r}, p_BoBq_B={self.p_BoBq_B.tolist()}, "
            f"F_Bq_W={self.F_Bq_W!r})"
        )


_register_value_type(ExternallyAppliedSpatialForce, with_list=True)


class SpatialForcePort(InputPort):
    """The applied_spatial_force port: fixing it makes the plant look at it."""

    def FixValue(self, context: Any, value: Any) -> Any:
        """Gives it this value in this context."""
        fixed = super().FixValue(context, value)
        plant = self.get_system()
        if not plant._spatial_forces_fixed:
            plant._spatial_forces_fixed = True
            plant._changed()
            store = context._store
            store.override(plant_node(plant, store), int(self.get_index()))
            slot = store.layout.input_slot(plant_node(plant, store), int(self.get_index()))
            store.i[store.layout.fixed0 + slot.free] = 1
        return fixed


def plant_node(plant: Any, store: Any) -> int:
    """Number of the plant in a root context."""
    return store.layout.node_of[plant._system_id]


class AppliedForces:
    """Choosing between native and Python rows, and the Python rows."""

    _spatial_forces_fixed = False

    def _input_port(self, i: int) -> Any:
        if self._finalized and i == self._port_numbers.get("spatial_force"):
            port = self._ports.get(("in", i))
            if port is None:
                port = self._ports["in", i] = SpatialForcePort._make(self, i)
            return port
        return super()._input_port(i)

    def _uses_spatial_forces(self) -> bool:
        """Whether the applied_spatial_force port is connected, exported, or was fixed."""
        if not self._finalized or self._spatial_forces_fixed:
            return self._finalized
        parent, me = self._parent(), None
        if parent is not None:
            me = next(k for k, s in enumerate(parent._systems) if s is self)
            port = me, self._port_numbers["spatial_force"]
            return port in parent._wires or port in parent._exported_inputs
        return False

    def _all_events(self) -> list[Any]:
        events = super()._all_events()
        if not self._uses_spatial_forces():
            return events
        step = Callback(type(self)._step_in_python, True)
        return [dataclasses.replace(e, handler=step) if isinstance(e.handler, Stages) else e for e in events]

    def _derivatives_calc(self) -> Any:
        if self._uses_spatial_forces():
            return Callback(type(self)._derivatives_in_python, True)
        return super()._derivatives_calc()

    def _applied_as_generalized(self, context: Any) -> np.ndarray:
        """Generalized forces of the applied spatial forces, shape (nv,)."""
        view = context._system._view(context)
        F_Bo_W = self._applied_body_forces(context, view.positions().X_WB)
        if F_Bo_W is None:
            return view.zeros(self._nv)
        return view.ask_generalized_forces(F_Bo_W)

    def _run(self, context: Any, work: Any, out: np.ndarray) -> None:
        """Runs the stages of the step or the derivatives on given scratch, with everything that acts from outside.

        Raises:
            RuntimeError: the kernel says why.
        """
        view = context._system._view(context)
        vectors = work.step if self.is_discrete() else work.flow
        vectors.applied_force[:] = self._applied_as_generalized(context)
        u = tuple(self._input_vector(context, i) for i in range(self.num_input_ports()))
        connected = context._system.get_geometry_query_input_port().HasValue(context)
        if self._misses_geometry(connected):
            raise self._explain_status(GEOMETRY_NOT_CONNECTED, context)
        if self._constraints and not self.is_discrete():
            raise self._explain_status(CONSTRAINTS_IN_CONTINUOUS_TIME, context)
        models = self._models(connected, self._geometry_of(context))
        stages = (self._step_stages if self.is_discrete() else self._derivative_stages)(models)
        status = view.run_chain(stages, **work._asdict(), **models, xd=view.x, xc=view.x, p=view.p, u=u, out=out)
        if status:
            raise self._explain_status(status, context)

    def _step_in_python(self, context: Any, target: Any) -> None:
        """The step as an update event: `target` is x+, as State or as DiscreteValues."""
        store = context._store
        out = store.S[slice(*(place + store.layout.plus for place in context._place.xd))]
        self._run(context, store.scratch(context._node), out)

    def _derivatives_in_python(self, context: Any, derivatives: Any) -> None:
        """Time derivatives into `derivatives`."""
        view = context._system._view(context)
        out = view.zeros(len(view.x))
        self._run(context, context._store.scratch(context._node), out)
        derivatives.SetFromVector(out)
