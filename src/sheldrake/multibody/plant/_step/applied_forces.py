"""Forces from outside that come as a list of objects.

A kernel does not see abstract inputs. Once the applied_spatial_force port is connected, exported or fixed, a stage in
Python comes before those of the step or the derivatives: it turns the list into generalized forces in their scratch.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from sheldrake.common.kernel import Kernel
from sheldrake.multibody.plant._building.elements import Elements
from sheldrake.multibody.plant._context.contexts import Contexts
from sheldrake.multibody.plant._context.view import View
from sheldrake.multibody.plant._kernels.applied_forces import (
    begin_forces_of_derivatives,
    begin_forces_of_step,
    end_forces_of_derivatives,
    end_forces_of_step,
)
from sheldrake.multibody.plant._step.external_force import ExternallyAppliedSpatialForce
from sheldrake.multibody.plant._step.input_ports import InputPorts, has_value
from sheldrake.multibody.tree._kernels.forces import add_body_forces
from sheldrake.multibody.tree._kernels.model import BodyPose
from sheldrake.systems.framework import Context, InputPort, System
from sheldrake.systems.framework._declarations import FedStage

if TYPE_CHECKING:
    from sheldrake.systems.framework import FixedInputPortValue
    from sheldrake.systems.framework._engine.memory import RootView
    from sheldrake.systems.framework._engine.store import Store


class SpatialForcePort(InputPort):
    """The applied_spatial_force port: fixing it makes the plant look at it."""

    def FixValue(self, context: Context, value: Any) -> FixedInputPortValue:
        """Gives it this value in this context."""
        fixed = super().FixValue(context, value)
        plant = self.get_system()
        applied: AppliedForces = plant._parts.applied_forces
        if not applied.are_fixed:
            applied.are_fixed = True
            plant._changed()
            store = context._store
            store.fix(plant_node(plant, store), int(self.get_index()), fixed.GetMutableData(), anew=True)
        return fixed


def plant_node(plant: Any, store: Store) -> int:
    """Number of the plant in a root context."""
    return store.layout.node_of[plant._system_id]


def stages_that_feed(plant: Any, rows_of: list[int], root: RootView, i: int) -> list[FedStage] | None:
    """The kernels of what feeds an input port with forces, each of which adds them to those on bodies.

    Args:
        plant: The plant that the forces act on.
        rows_of: The row of each of its bodies.
        root: What the system with the port may ask.
        i: The port.

    Returns:
        The kernels; None if what feeds the port has none for this plant.
    """
    source = root.source(i)
    offers = getattr(source[0], "_native_forces", None) if source is not None else None
    return offers(plant, rows_of, root.feeding(i)) if offers is not None else None


class AppliedForces:
    """What acts on bodies from outside.

    Args:
        elements: The bodies.
        contexts: Where they are.
        inputs: Where forces come from.
    """

    def __init__(self, elements: Elements, contexts: Contexts, inputs: InputPorts) -> None:
        self._elements, self._contexts, self._inputs = elements, contexts, inputs
        self.are_fixed = False
        """Whether the port was given a value in any context."""

    def are_used(self, plant: System) -> bool:
        """Whether the applied_spatial_force port of a plant is connected, exported, or was fixed."""
        if not self._elements.is_finalized() or self.are_fixed:
            return self._elements.is_finalized()
        parent = plant._parent()
        if parent is None:
            return False
        me = next(k for k, s in enumerate(parent._systems) if s is plant)
        port = me, self._inputs.spatial_force
        return port in parent._wires or port in parent._exported_inputs

    def native_stages(self, plant: Any, root: RootView) -> list[Kernel | FedStage] | None:
        """The kernels of what feeds the applied_spatial_force port; None if it has none for this plant."""
        rows = self._elements.model("MultibodyPlant").row_list
        stages = stages_that_feed(plant, rows, root, self._inputs.spatial_force)
        if stages is None:
            return None
        if plant.is_discrete():
            return [begin_forces_of_step, *stages, end_forces_of_step]
        return [begin_forces_of_derivatives, *stages, end_forces_of_derivatives]

    def are_given(self, context: Context) -> bool:
        """Whether the applied_spatial_force port has a value."""
        return has_value(context, self._inputs.spatial_force)

    def amount(self, context: Context) -> tuple[np.ndarray, np.ndarray]:
        """What the applied spatial forces amount to: generalized forces, shape (nv,), and forces by body about `root`.

        The latter have shape (num_bodies, 6), and hold until the next call.
        """
        view = self._contexts.view(context)
        if view.S.dtype == float:
            return self._of_floats(context, view)
        F_Bo_W, F = self.on_bodies(context, view.X_WB()), view.zeros(view.nb, 6)
        if F_Bo_W is None:
            return view.zeros(view.nv), F
        add_body_forces(view.model, view.positions(), F_Bo_W, F)
        return view.ask_generalized_forces(F_Bo_W), F

    def _of_floats(self, context: Context, view: View) -> tuple[np.ndarray, np.ndarray]:
        """The same in a context of floats, by one kernel for all forces."""
        applied = self._given(context)
        rows, points, forces, F, ask = view.applied_forces(len(applied))
        bodies, row_of = view.nb, view.frozen.row_list
        for i, one in enumerate(applied):
            body = one._body_index._value
            if not 0 <= body < bodies:
                self._elements.bodies.get(one._body_index, "applied_spatial_force")  # which says that there is none
            rows[i], points[i], forces[i] = row_of[body], one._p_BoBq_B, one.F_Bq_W._c
        rows[-1] = len(applied)
        return ask(), F

    def _given(self, context: Context) -> Sequence[ExternallyAppliedSpatialForce]:
        """What the applied_spatial_force port says; nothing where it has no value."""
        i = self._inputs.spatial_force
        return context._system._input_port(i).Eval(context) if has_value(context, i) else ()

    def on_bodies(self, context: Context, X_WB: np.ndarray) -> np.ndarray | None:
        """Forces of the applied_spatial_force port at the body origins by row, None without any.

        Raises:
            RuntimeError: a force names a body that does not exist.
        """
        applied = self._given(context)
        if not applied:
            return None
        rows = self._elements.model("applied_spatial_force").rows
        F = np.zeros((len(rows), 6), dtype=X_WB.dtype)
        for one in applied:
            body = self._elements.bodies.get(one.body_index, "applied_spatial_force")
            row, coefficients = rows[int(body.index())], one.F_Bq_W.get_coeffs()
            arm = X_WB[row, BodyPose.R_WB.columns].reshape(3, 3) @ one.p_BoBq_B
            F[row, :3] += coefficients[:3] + np.cross(arm, coefficients[3:])
            F[row, 3:] += coefficients[3:]
        return F
