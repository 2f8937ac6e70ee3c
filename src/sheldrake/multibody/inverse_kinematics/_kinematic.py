"""What costs and constraints on the positions of a plant have in common."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from sheldrake.autodiffutils import AutoDiffXd
from sheldrake.common._kinds import called, instance_of
from sheldrake.common._overloads import incompatible
from sheldrake.multibody.inverse_kinematics._kernels.forms import Between, Form, Forms, form_slopes, form_values
from sheldrake.multibody.plant import MultibodyPlant
from sheldrake.multibody.plant._parts import parts_of
from sheldrake.multibody.tree import Frame, JacobianWrtVariable
from sheldrake.solvers import _arrays
from sheldrake.solvers._functions.evaluators import EvaluatorBase, Opaque, WithSlopes

if TYPE_CHECKING:
    from numpy.typing import ArrayLike

    from sheldrake.multibody.plant._context.view import View
    from sheldrake.systems.framework import Context

QDOT = JacobianWrtVariable.kQDot
PLANT, FRAME = instance_of(MultibodyPlant), instance_of(Frame)
PLANT_OR_NONE = instance_of(MultibodyPlant, type(None))  # which `_set_plant` refuses, as Drake does
_ORIGIN = np.zeros(3)
POSE, POINT = called("RigidTransform"), called("float array of shape (3,)")


class KinematicFunction(Opaque, WithSlopes):
    """A function of the positions q of a plant; its context is where they are put.

    Of a plant of floats the derivatives come from its Jacobians; a plant of AutoDiffXd carries them itself.
    """

    _thread_safe = False
    _plant: MultibodyPlant
    _context: Any
    _A: Any  # where there are forms: their frames
    _B: Any
    _num_outputs: int
    _num_vars: int
    _nq: int

    def _set_plant(
        self, plant: MultibodyPlant | None, context: Context | None, num_outputs: int, more_vars: int = 0
    ) -> None:
        if plant is None or context is None:
            raise ValueError(f"{type(self).__name__}: {'plant' if plant is None else 'plant_context'} is None.")
        self._plant, self._context = plant, context
        self._is_float, self._nq = plant._scalar is float, plant.num_positions()
        self._set_sizes(num_outputs, self._nq + more_vars)  # type: ignore[attr-defined]

    def _place(self, q: np.ndarray) -> View | None:
        """Puts positions into the context, if they are not there already; its view, of a plant of floats."""
        if not self._is_float:
            duals = np.array([v if isinstance(v, AutoDiffXd) else AutoDiffXd(float(v)) for v in q], dtype=object)
            self._plant.SetPositions(self._context, duals)
            return None
        view = parts_of(self._plant).contexts.view(self._context)
        if view.q.tobytes() != q.tobytes():
            self._plant.SetPositions(self._context, q)
        return view

    def _forms(self) -> list[np.ndarray] | None:
        """Values as a `Form` each, of `_frames`; None if they are no forms."""
        return None

    def _frames(self) -> tuple[Frame, Frame]:
        """A and B of the forms."""
        return self._A, self._B

    _own_forms: Forms | None = None

    def _ask_forms(self, view: View | None) -> _AskedForms | None:
        """Queries of the forms for a view as it is; None if there are none, or the plant is none of floats."""
        if view is None:
            return None
        forms = self._own_forms
        if forms is None:
            found = self._forms()
            if found is None:
                return None
            forms = self._own_forms = _table(self._plant, self._context, *self._frames(), found)
        count = len(forms.form)
        asked: _AskedForms | None = view.forms.get(count)
        if asked is None:
            asked = view.forms[count] = _AskedForms(view, count)
        asked.take(forms)
        return asked

    def _value(self, more: np.ndarray) -> np.ndarray:
        """Values at the positions in the context."""
        raise NotImplementedError

    def _slope(self, more: np.ndarray) -> np.ndarray:
        """Derivatives by q (and the variables beyond), at the positions in the context of a plant of floats."""
        raise NotImplementedError

    def _split(self, x: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        return x[: self._nq], x[self._nq :]

    def _eval(self, x: np.ndarray) -> np.ndarray:
        q, more = self._split(x)
        asked = self._ask_forms(self._place(q))
        if asked is not None:
            return asked.values()
        y = _vector(self._value(more))
        return _arrays.values_and_gradient(y)[0] if y.dtype == object else y

    def _eval_with_jacobian(self, x: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        if not self._is_float:
            return _arrays.values_and_gradient(self._eval_duals(_arrays.variables_at(x)))
        q, more = self._split(x)
        view = self._place(q)
        asked = self._ask_forms(view)
        if view is not None and asked is not None:
            found = asked.slopes()
            return found[:, 0], found[:, 1:] if view.frozen.v_is_qdot else self._by_q(found[:, 1:])
        slope = self._slope(more)
        return _vector(self._value(more)), slope if slope.ndim == 2 else slope.reshape(1, -1)

    def _eval_duals(self, x: np.ndarray) -> np.ndarray:
        if self._is_float:
            return EvaluatorBase._eval_duals(self, x)  # type: ignore[arg-type]
        q, more = self._split(x)
        self._place(q)
        y = np.atleast_1d(self._value(more))
        return np.array([v if isinstance(v, AutoDiffXd) else AutoDiffXd(float(v)) for v in y], dtype=object)

    def _eval_symbols(self, x: np.ndarray) -> np.ndarray:
        raise RuntimeError(f"{type(self).__name__}::DoEval() does not work for symbolic variables.")

    # Kinematics of the plant

    def _by_q(self, by_v: np.ndarray) -> np.ndarray:
        """Derivatives by q from those by v."""
        parts = parts_of(self._plant)
        is_same = parts.contexts.view(self._context).frozen.v_is_qdot
        return by_v if is_same else by_v @ parts.dynamics.qdot_to_velocity(self._context)

    def _point(self, frame_B: Frame, p_BQ: np.ndarray, frame_A: Frame) -> np.ndarray:
        """p_AQ, shape (3,)."""
        if self._is_float:
            parts = parts_of(self._plant)
            return parts.kinematics.ask_point(parts.contexts.view(self._context), frame_B, frame_A)(p_BQ)
        return self._plant.CalcPointsPositions(self._context, frame_B, p_BQ.reshape(3, 1), frame_A)[:, 0]

    def _point_slope(self, frame_B: Frame, p_BQ: np.ndarray, frame_A: Frame) -> np.ndarray:
        """Derivative of p_AQ by q, shape (3, nq)."""
        J: np.ndarray = self._plant.CalcJacobianSpatialVelocity(self._context, QDOT, frame_B, p_BQ, frame_A, frame_A)
        return J[3:]

    def _rotation(self, frame_A: Frame, frame_B: Frame) -> np.ndarray:
        """R_AB, shape (3, 3)."""
        if self._is_float:
            return parts_of(self._plant).kinematics.relative_pose(self._context, frame_A, frame_B)[:9].reshape(3, 3)
        return self._plant.CalcRelativeTransform(self._context, frame_A, frame_B).rotation().matrix()


class _AskedForms:
    """Queries for values of so many forms, and for these with their derivatives by v, at the positions of a view."""

    def __init__(self, view: View, count: int):
        self._room = Forms(np.zeros((count, Between.SIZE), np.int64), np.zeros((count, Form.SIZE)))
        values, found = np.zeros(count), np.zeros((count, 1 + view.nv))
        asked = view.queries
        tree = asked.model, asked.p, asked.work, self._room
        self.values = view.bind(asked.calls.query(form_values, *tree, values, needs=view.POSES, answer=values))
        self.slopes = view.bind(asked.calls.query(form_slopes, *tree, found, needs=view.POSES, answer=found))
        self._taken: Forms | None = None

    def take(self, forms: Forms) -> None:
        """Has these be what is asked for."""
        if forms is not self._taken:
            self._taken = forms
            self._room.between[:], self._room.form[:] = forms


def _table(plant: MultibodyPlant, context: Context, frame_A: Frame, frame_B: Frame, forms: list[np.ndarray]) -> Forms:
    """Forms of frame B in frame A."""
    parts = parts_of(plant)
    view, place = parts.contexts.view(context), parts.kinematics.place
    ends = (*place(view, frame_A), *place(view, frame_B))
    return Forms(np.array([ends] * len(forms), np.int64), np.array(forms))


def form(**given: ArrayLike) -> np.ndarray:
    """A `Form`; what is not given is zero."""
    out = np.zeros(Form.SIZE)
    for name, value in given.items():
        out[getattr(Form, name).columns] = np.ravel(value)
    return out


def _vector(y: Any) -> np.ndarray:
    return y if type(y) is np.ndarray and y.ndim else np.atleast_1d(y)


def vector3(call: str, name: str, value: ArrayLike) -> np.ndarray:
    """Three floats.

    Raises:
        TypeError: it is something else.
    """
    try:
        v = np.array(value, dtype=float).reshape(-1)
    except (TypeError, ValueError):
        v = np.zeros(0)
    if v.size != 3:
        raise incompatible(call, [f"{name}: numpy.ndarray of shape (3,)"], (value,), {})
    return v


def unit3(call: str, name: str, value: ArrayLike) -> np.ndarray:
    """A direction of length one.

    Raises:
        ValueError: it is zero.
    """
    v = vector3(call, name, value)
    length = np.linalg.norm(v)
    if length < 100.0 * np.finfo(float).eps:
        raise ValueError(f"{name} is close to a zero vector.")
    return v / length
