"""How a plant reads and writes contexts, and what it keeps computed for one."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike

from sheldrake.math import RigidTransform, RigidTransform_
from sheldrake.multibody.math import SpatialInertia, SpatialInertia_, UnitInertia_
from sheldrake.multibody.plant._building.elements import Elements
from sheldrake.multibody.plant._building.frozen_model import FrozenModel
from sheldrake.multibody.plant._building.surface_axes import SurfaceAxes
from sheldrake.multibody.plant._context.view import View
from sheldrake.multibody.tree import Joint
from sheldrake.systems.framework import BasicVector, Context, ContinuousStateIndex, LeafSystem, State
from sheldrake.systems.framework._engine.store import CONSTANT
from sheldrake.systems.framework._vector import lifted, plain

if TYPE_CHECKING:
    from sheldrake.common import RandomGenerator
    from sheldrake.systems.framework import DiscreteStateIndex


class Contexts:
    """Reading and writing contexts of one plant.

    Args:
        plant: The system that contexts are made for.
        elements: Its elements.
        family: The same for copies of the plant on other scalars, which take each other's contexts.
        is_discrete: Whether their state is discrete.
        axes: Surfaces that run: continuous state says how far.
    """

    def __init__(
        self, plant: LeafSystem, elements: Elements, family: object, is_discrete: bool, axes: SurfaceAxes
    ) -> None:
        self._plant, self._elements, self.family, self._is_discrete = plant, elements, family, is_discrete
        self._axes = axes

    @property
    def scalar(self) -> type:
        """The scalar type of contexts that the plant makes."""
        return self._plant._scalar

    def view(self, context: Context) -> View:
        """The view of a context, after checking that it is one of this plant.

        Raises:
            RuntimeError: the context belongs to another system, or the plant is not finalized.
        """
        try:
            view = context._kept
            if view.family is self.family:
                return view
        except AttributeError:
            pass
        return self._new_view(context)

    def _new_view(self, context: Context) -> View:
        system = getattr(context, "_system", None)
        if system is None:
            self._plant.ValidateContext(context)  # It is none at all.
        model = self._elements.model("ValidateContext")
        if system is not self._plant and not self._is_of_family(system):
            self._plant.ValidateContext(context)
        store = context._store
        view = store.views.get(context._node)
        if view is None or view.S is not store.S:
            view = store.views[context._node] = View(model, self.family, context)
        context._kept = view
        return view

    def _is_of_family(self, system: Any) -> bool:
        contexts = getattr(getattr(system, "_parts", None), "contexts", None)
        return isinstance(contexts, Contexts) and contexts.family is self.family

    # --- defaults

    def declare(self) -> DiscreteStateIndex | ContinuousStateIndex:
        """Declares parameters and state of a finalized plant; the index of the state."""
        self._plant._declare_numeric_parameters(self._model.parameters.defaults)
        if self._is_discrete:
            return self._plant.DeclareDiscreteState(self._default_state())
        x0 = BasicVector(self._default_state())
        return self._plant.DeclareContinuousState(x0, self._model.nq, self._model.nv, self.num_misc_states())

    def num_misc_states(self) -> int:
        """How many continuous variables there are behind positions and velocities."""
        return 0 if self._is_discrete else len(self._axes.bodies())

    def _default_state(self) -> np.ndarray:
        return np.concatenate([self._model.default_positions(), np.zeros(self._model.nv + self.num_misc_states())])

    def set_defaults(self, context: Context) -> None:
        """Sets what defaults may have become since Finalize()."""
        store, place, model = context._store, context._place, self._model
        start = (place.xd if self._is_discrete else place.xc)[0]
        store.S[start : start + model.nq] = lifted(model.default_positions(), store.scalar)
        if not model.actuators:
            return
        rotors = [x for a in model.actuators for x in (a.default_rotor_inertia(), a.default_gear_ratio())]
        store.S[place.p[0] + model.rotors_at.ravel()] = lifted(np.array(rotors, float), store.scalar)

    def set_random_positions(self, context: Context, generator: RandomGenerator) -> None:
        """Draws positions from the distributions that joints were given."""
        from sheldrake.math import UniformlyRandomQuaternion
        from sheldrake.symbolic import Expression

        for joint in self._model.joints:
            if joint._random_q is None:
                continue
            drawn = list(joint._random_q)
            if isinstance(drawn[0], str):
                drawn[:4] = UniformlyRandomQuaternion(generator).wxyz()
            values = [x if type(x) is float else Expression(x).Evaluate(None, generator) for x in drawn]
            self.write_positions(context, joint._q_start, np.array(values))

    def SetDefaultState(self, context: Context, state: State) -> None:
        """Sets a state of a context's structure to the default positions, at rest."""
        self.view(context)
        if self._is_discrete:
            state.get_mutable_discrete_state().get_mutable_vector(0).SetFromVector(self._default_state())
        else:
            state.get_mutable_continuous_state().SetFromVector(self._default_state())

    # --- state

    def positions(self, context: Context) -> np.ndarray:
        """All q, to be read only."""
        return self.view(context).q

    def velocities(self, context: Context) -> np.ndarray:
        """All v, to be read only."""
        return self.view(context).v

    def write(self, context: Context, part: str, start: int, values: Any, *more: Any) -> bool:
        """Sets positions ("q") or velocities ("v") if they are what kernels take: an array of finite numbers, or one.

        For "pose" the arguments are the rotation matrix and the position that a quaternion and three positions say.

        Returns:
            Whether it did; otherwise nothing has changed.
        """
        view = self.view(context)
        if context._store.claimed:
            context._store.check_thread()
        size = len(values) if type(values) is np.ndarray else 0
        key = part, start, size
        ask = view.writers.get(key) or view.keep(view.writers, key, view.queries.writer(*key))
        return not ask(values, *more)

    def write_positions(self, context: Context, start: int, values: Sequence[Any] | np.ndarray) -> None:
        """Sets positions from number `start` on."""
        view = self.view(context)
        context._store.touch(view.level, view.source)  # first: it refuses other threads
        view.q[start : start + len(values)] = values if view.T is float else lifted(np.asarray(values), view.T)

    def write_velocities(self, context: Context, start: int, values: Sequence[Any] | np.ndarray) -> None:
        """Sets velocities from number `start` on."""
        view = self.view(context)
        context._store.touch(view.level, view.source)  # first: it refuses other threads
        view.v[start : start + len(values)] = values if view.T is float else lifted(np.asarray(values), view.T)

    def wrote(self, context: Context, view: View) -> None:
        """To be called after writing into the state: what depends on it is out of date."""
        context._store.touch(view.level, view.source)

    # --- parameters

    def numbers(self, context: Context, group: int) -> np.ndarray:
        """A group of numeric parameters."""
        view = self.view(context)
        return view.p[view.frozen.parameters.of(group)]

    def write_numbers(self, context: Context, group: int, values: ArrayLike) -> None:
        """Sets a group of numeric parameters."""
        view = self.view(context)
        place = view.frozen.parameters.of(group)
        if view.T is float and isinstance(values, np.ndarray) and values.shape == (place.stop - place.start,):
            context._store.touch(CONSTANT, ("pn", context._place.parameters[0] + group))  # first: it refuses threads
            view.p[place] = values
        else:
            context.get_mutable_numeric_parameter(group).SetFromVector(values)

    def parameter_columns(self, what: str) -> np.ndarray:
        """Numbers of a plant's parameters, all groups in turn: columns of `BatchSimulator.parameters(plant)`.

        Drake has no such call, and no parameters "gravity", "friction" and "gains".

        Args:
            what: "mass": of each body by its index [kg], shape (num_bodies,). "damping": of each velocity [N m s/rad or
                N s/m], shape (nv,). "gravity": what is added to the gravity of all bodies, in W [m/s²], shape (3,).
                "friction": what the friction coefficients of a body's geometry are multiplied with, by its index, shape
                (num_bodies,). "gains": what the PD gains p and d of each actuator are multiplied with, positive, shape
                (num_actuators, 2). By default 0 is added to gravity, and the others are multiplied with 1.

        Raises:
            ValueError: it is none of these.
            RuntimeError: the plant is not finalized.
        """
        model = self._elements.model("parameter_columns")
        starts = model.parameters.starts
        if what == "mass":
            return np.array([model.start_of(body) for body in self._elements.bodies], np.int64)
        if what == "damping":
            return model.damping_at.copy()
        if what not in model.tuning:
            raise ValueError(
                f"MultibodyPlant.parameter_columns(): {what!r} is not among the parameters of a plant, which are "
                "'mass', 'damping', 'gravity', 'friction' and 'gains'. Shapes, stiffness of contact and all else "
                "belong to the model: make a diagram for each."
            )
        group = model.tuning[what]
        columns = starts[group] + np.arange(len(model.parameters.defaults[group]))
        return columns.reshape(-1, 2) if what == "gains" else columns

    def is_locked(self, context: Context, joint: Joint) -> bool:
        """Whether a joint is locked."""
        return bool(plain(self.numbers(context, self._model.lock_group)[int(joint.index())]))

    def any_locked(self, context: Context) -> bool:
        """Whether any joint is locked."""
        model = self._model
        if getattr(context, "_system", None) is not self._plant:
            flags = self.numbers(context, model.lock_group)
        else:  # without a view, which a context may never need
            p = context._store.S[slice(*context._place.p)]
            flags = p[model.parameters.of(model.lock_group)]
        return any(flags.tolist() if flags.dtype == float else map(plain, flags))

    def set_locked(self, context: Context, joint: Joint, locked: bool) -> None:
        """Locks or unlocks a joint."""
        flags = np.array(self.numbers(context, self._model.lock_group))
        flags[int(joint.index())] = float(locked)
        self.write_numbers(context, self._model.lock_group, flags)

    @property
    def _model(self) -> FrozenModel:
        return self._elements.model("ValidateContext")

    # --- numbers to objects

    def transform(self, context: Context, numbers: np.ndarray) -> RigidTransform:
        """A RigidTransform, of the context's scalar, of twelve numbers: R row by row, then p."""
        make = self.view(context).of(RigidTransform_)._make
        return make(numbers[:9].reshape(3, 3).copy(), numbers[9:12].copy())

    def transforms(self, context: Context, numbers: np.ndarray) -> list[RigidTransform]:
        """The same of many rows of twelve numbers."""
        make_each = self.view(context).of(RigidTransform_)._make_each
        return make_each(numbers[:, :9].reshape(-1, 3, 3), numbers[:, 9:12].copy())

    def spatial_inertia(self, context: Context, group: int) -> SpatialInertia:
        """A SpatialInertia, of the context's scalar, of the ten parameters of a body."""
        view = self.view(context)
        if (ask := view.inertia_of_body(group)) is not None:
            return ask()
        T, numbers = view.T, self.numbers(context, group)
        mass, c, G = numbers[0], np.array(numbers[1:4]), UnitInertia_[T](*numbers[4:10])
        return SpatialInertia_[T](mass, c, G, skip_validity_check=True)
