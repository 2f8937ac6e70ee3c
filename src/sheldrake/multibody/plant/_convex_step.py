"""Steps of any length of a continuous plant by the convex problem of kLagged, for integrators."""

from __future__ import annotations

from typing import Any

import numpy as np

from sheldrake.common.chain import Chain
from sheldrake.common.kernel import jit_enabled
from sheldrake.geometry._kernels.cells import make_cells
from sheldrake.geometry._kernels.model import contact_table
from sheldrake.multibody.contact_solvers._kernels import problem as columns
from sheldrake.multibody.contact_solvers._kernels.solve import prepare_problem
from sheldrake.multibody.plant import _step
from sheldrake.multibody.plant._enums import ContactModel
from sheldrake.multibody.plant._kernels.forces import add_actuation, add_applied_forces
from sheldrake.multibody.plant._kernels.ports import GEOMETRY_NOT_CONNECTED
from sheldrake.multibody.plant._kernels.stribeck import static_friction
from sheldrake.multibody.tree._kernels.model import DAMPING

DIFFERENCE = 1e-6
"""By how much velocities are changed to see what forces do [m/s or rad/s]."""


class ConvexStep:
    """Solves the convex problem of a step from the state of a plant's context, with arrays of its own.

    Joint limits, constraints and PD gains are part of the problem, as in a discrete plant. Forces that come from other
    systems of the diagram are linearized in the velocity of the joint they act on, and are implicit in so far as they
    brake it, so that stiff controllers need no short steps.

    Args:
        plant: a finalized plant with time_step = 0.
        context: its context.

    Raises:
        RuntimeError: the plant has collision geometry, but is connected to no SceneGraph.
    """

    def __init__(self, plant: Any, context: Any):
        self._plant, self._context = plant, context
        self._compiled = plant._geometry_of(context)
        connected = plant.get_geometry_query_input_port().HasValue(context)
        if plant._misses_geometry(connected):
            raise plant._explain_status(GEOMETRY_NOT_CONNECTED, context)
        models = plant._models(connected, self._compiled)
        geometry = models["geometry_model"]
        models["geometry_model"] = geometry = geometry._replace(margin=np.array([_step.CONTACT_MARGIN, 0.0]))
        models["plant_model"] = self._plant_model = plant_model = self._with_limits(models["plant_model"])
        models["solver_model"] = self._solver = solver = _step.solver_model_of(
            plant._tree_model, geometry, 1.0, "lagged", stiction_tolerance=plant._stiction_tolerance
        )
        hydro = models["hydro_model"]
        self._work = _step.make_step_work(
            plant._tree_model,
            solver,
            plant_model,
            contact_table(geometry),
            hydro_model=hydro,
            cells=make_cells(geometry),
        )
        strict = plant._contact_model is ContactModel.kHydroelastic
        stages = _step.stages(geometry, plant_model, False, hydro, strict)
        stages.insert(stages.index(prepare_problem), static_friction)
        quaternions = [j._q_start for j in plant._joints if j.type_name() == "quaternion_floating"]
        self._quaternions = np.array(quaternions, int)[:, None] + np.arange(4)
        self._x, self._out = np.zeros(plant.num_multibody_states()), np.zeros(plant.num_multibody_states())
        self._p = np.zeros(len(context._system._view(context).p))
        self._u = tuple(np.zeros(len(plant._input_vector(context, i))) for i in range(plant.num_input_ports()))
        self._inputs = [(context._system.get_input_port(i), u) for i, u in enumerate(self._u) if len(u)]
        self._feedback = plant._uses_spatial_forces() or self._is_fed()
        values = {**self._work._asdict(), **models, "xd": self._x, "p": self._p, "u": self._u, "out": self._out}
        chain = Chain(stages)
        self._solve = chain.bind(**values) if jit_enabled() else lambda: chain(**values)

    def _with_limits(self, model: Any) -> Any:
        """Position limits, which derivatives do without."""
        joints = [j for j in self._plant._joints if j.num_velocities() == 1 and self._plant._has_limits(j)]
        rows = [(j, *j._limits["position"]) for j in joints]
        limits = [dict(dof=j._v_start, q=j._q_start, lower=low[0], upper=high[0]) for j, low, high in rows]
        made = _step.make_plant_model(limits=limits)
        return model._replace(limit=made.limit, bound=made.bound)

    def _is_fed(self) -> bool:
        """Whether other systems of the diagram give forces."""
        plant = self._plant
        parent = plant._parent()
        me = next(k for k, system in enumerate(parent._systems) if system is plant)
        given = {"actuation", "generalized_force"}
        forces = [n for key, n in plant._port_numbers.items() if key in given or key[0] in given]
        return any((me, n) in parent._wires for n in forces)

    def _read_inputs(self) -> None:
        """What the ports give at the context's state."""
        spatial = self._plant._uses_spatial_forces()
        self._work.step.applied_force[:] = self._plant._applied_as_generalized(self._context) if spatial else 0.0
        for port, values in self._inputs:
            values[:] = port.Eval(self._context) if port.HasValue(self._context) else 0.0

    def _force_of_inputs(self) -> np.ndarray:
        """Generalized forces of the ports at the context's state, shape (nv,)."""
        self._read_inputs()
        model, tau = self._plant_model, np.zeros(self._plant.num_velocities())
        add_applied_forces(model, self._u, self._work.step.applied_force, tau)
        add_actuation(model, self._u, tau, np.zeros(len(model.actuator)), True)
        return tau

    def _linearize(self, h: float) -> None:
        """Reads the ports where the step leads with its first velocity, and adds damping for what they brake.

        tau(v) = tau0 - K (v - v0): K goes to the joints' damping, which is implicit, and K v0 to the applied force.
        """
        plant, context, nq = self._plant, self._context, self._plant.num_positions()
        x0, v0 = self._x.copy(), self._x[nq:].copy()

        N = plant.MakeVelocityToQDotMap(context)

        def go(v: np.ndarray) -> None:
            plant.SetPositionsAndVelocities(context, np.r_[x0[:nq] + h * (N @ v), v])

        gains = np.zeros(len(v0))
        go(v0)
        tau0 = self._force_of_inputs()
        for k in range(len(v0)):
            v = v0.copy()
            v[k] += DIFFERENCE * max(1.0, abs(v0[k]))
            go(v)
            gains[k] = max(0.0, (tau0[k] - self._force_of_inputs()[k]) / (v[k] - v0[k]))
        go(v0)
        self._read_inputs()
        plant.SetPositionsAndVelocities(context, x0)
        self._p[plant._tree_model.dof[:, DAMPING]] += gains
        self._work.step.applied_force[:] += gains * v0

    def fits(self, context: Any) -> bool:
        """Whether this was made for the context and the geometry it has now."""
        return context is self._context and self._plant._geometry_of(context).model is self._compiled.model

    def use(self, max_iterations: int, tolerance: float) -> None:
        """Settings of the solver.

        Args:
            max_iterations: most Newton iterations.
            tolerance: residual at which they stop, relative to momentum and impulse.
        """
        self._solver.setting[columns.MAX_ITERATIONS] = max_iterations
        self._solver.option[columns.RELATIVE_TOLERANCE] = tolerance

    def __call__(self, h: float) -> np.ndarray:
        """Positions and velocities a step of h later [s]; quaternions have length one.

        Raises:
            RuntimeError: the solver says why.
        """
        plant, context = self._plant, self._context
        view = context._system._view(context)
        self._x[:], self._p[:] = view.x, view.p
        self._solver.option[columns.DT] = h
        if self._feedback:
            self._linearize(h)
        else:
            self._read_inputs()
        status = self._solve()
        if status:
            raise plant._explain_status(status, context)
        end = self._out.copy()
        q = end[self._quaternions]
        end[self._quaternions] = q / np.sqrt((q * q).sum(axis=1, keepdims=True))
        return end
