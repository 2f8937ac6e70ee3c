"""What every trajectory can do.

The base of all classes here, and of trajectories that users write.
"""

from __future__ import annotations

import operator
import weakref
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np

from sheldrake.common._checked import checked
from sheldrake.common._names import pretty_class_name
from sheldrake.common._overloads import Mismatch
from sheldrake.common._scalars import any_array, as_scalar

if TYPE_CHECKING:
    from collections.abc import Callable

    from sheldrake.common._scalars import ScalarTemplate
    from sheldrake.common._types import KernelArgument, Scalar, Scalars
    from sheldrake.common.calls import Query
    from sheldrake.common.kernel import Kernel

_FLOAT64 = np.dtype(np.float64)
_FEW = 3
_NONE: dict = {}


def _pure(name: str) -> RuntimeError:
    return RuntimeError(f'Tried to call pure virtual function "Trajectory<T>::{name}"')


class Trajectory:
    """A matrix that depends on time.

    To make your own, derive from this class and define `do_value(t)`, `do_rows()`, `do_cols()`, `do_start_time()`,
    `do_end_time()`; for derivatives also `do_has_derivative()`, `DoEvalDerivative(t, derivative_order)` and
    `DoMakeDerivative(derivative_order)`.
    """

    _T: ClassVar[type] = float
    _template: ClassVar[Any]
    _MAKES_ARRAYS: ClassVar[bool] = False
    """Whether values and derivatives are new matrices each time, as they are: users' own may be anything."""
    _HAS_QUERIES: ClassVar[bool] = False
    """Whether `_make_query` is defined."""
    _queries: dict[Any, Query | None] = _NONE
    _times_asked: dict[Any, int] = _NONE

    def __init__(self) -> None:
        pass

    def value(self, t: Scalar) -> np.ndarray:
        """Returns the matrix at time t [s], shape `(rows, cols)`."""
        ask = self._queries.get(0)
        if ask is not None and type(value := ask(t)) is np.ndarray:
            return value
        time = self._scalar("value", t)
        if ask is None and self._HAS_QUERIES:
            ask = self._soon(0, self._make_query)
        return self._made("value", ask(time) if ask else self.do_value(time))

    def _made(self, call: str, value: Any) -> np.ndarray:
        """What a trajectory has made, as a matrix of its own."""
        if self._MAKES_ARRAYS and type(value) is np.ndarray and value.dtype is _FLOAT64 and value.ndim == 2:
            return value
        return self._matrix(call, value)

    def _soon(self, key: Any, make: Callable[[Any], Query | None]) -> Query | None:
        """A function of a float that `make` gives for a key, when it was asked for some times: to make one takes ten
        times longer than a value in Python does.
        """
        queries, times = self._queries, self._times_asked
        if key in queries:
            return queries[key]
        if not times:
            self._queries, self._times_asked = queries, times = {}, {}
        times[key] = asked = times.get(key, 0) + 1
        if asked <= _FEW:
            return None
        queries[key] = query = make(key) if _is_ours(self) else None  # another class computes its own
        return query

    def _make_query(self, order: int) -> Query | None:
        """That function, of plain numbers; it gives MISFIT for what is no float. None where there is none."""
        raise NotImplementedError

    def _changed(self) -> None:
        """Forgets queries of numbers that are no longer right."""
        self._queries = self._times_asked = _NONE

    def vector_values(self, t: Scalars) -> np.ndarray:
        """Returns the vectors at many times [s], shape `(rows, n)` for columns and `(n, cols)` for rows.

        Raises:
            RuntimeError: the values are matrices.
        """
        ask = self._queries.get("many")
        if ask is not None and type(values := ask(np.array(t) if t.__class__ is list else t)) is np.ndarray:
            return values
        times = self._scalars("vector_values", t)
        rows, cols = self.rows(), self.cols()
        if rows != 1 and cols != 1:
            raise RuntimeError(
                "vector_values(): This method only supports vector-valued trajectories; "
                f"the values are {rows} x {cols}."
            )
        ask = self._soon("many", self._make_query_of_many) if self._HAS_QUERIES else None
        if ask is not None and type(values := ask(np.array(times))) is np.ndarray:
            return values
        out = self._vector_values(times)
        return out if cols == 1 else out.T

    def _make_query_of_many(self, key: str) -> Query | None:
        """A function of an array of times that gives `vector_values` of plain numbers. None where there is none."""
        return None

    def _vector_values(self, times: list) -> np.ndarray:
        """Values at many times as columns."""
        if not times:
            return np.zeros((max(self.rows(), self.cols()), 0))
        values = list(map(self._queries.get(0) or self.value, times))
        return np.concatenate(values, axis=1) if values[0].shape[1] == 1 else np.concatenate(values).T

    def has_derivative(self) -> bool:
        """Tells whether `EvalDerivative` and `MakeDerivative` work."""
        return bool(self.do_has_derivative())

    def EvalDerivative(self, t: Scalar, derivative_order: int = 1) -> np.ndarray:
        """Returns the derivative of the given order at time t [s], shape `(rows, cols)`.

        Raises:
            RuntimeError: there are no derivatives, or the order is negative.
        """
        ask = self._queries.get(derivative_order)
        if ask is not None and type(value := ask(t)) is np.ndarray:
            return value
        time = self._scalar("EvalDerivative", t)
        if _order("EvalDerivative", derivative_order) == 0:
            return self.value(t)
        if ask is None and self._HAS_QUERIES:
            ask = self._soon(derivative_order, self._make_query)
        return self._made("EvalDerivative", ask(time) if ask else self.DoEvalDerivative(time, derivative_order))

    @checked
    def MakeDerivative(self, derivative_order: int = 1) -> Trajectory:
        """Returns the derivative of the given order as a trajectory.

        Raises:
            RuntimeError: there are no derivatives, or the order is negative.
        """
        if _order("MakeDerivative", derivative_order) == 0:
            return self.Clone()
        return self.DoMakeDerivative(derivative_order)

    def rows(self) -> int:
        """Returns the number of rows."""
        return self.do_rows()

    def cols(self) -> int:
        """Returns the number of columns."""
        return self.do_cols()

    def start_time(self) -> float:
        """Returns the first time [s]."""
        return self.do_start_time()

    def end_time(self) -> float:
        """Returns the last time [s]."""
        return self.do_end_time()

    def Clone(self) -> Trajectory:
        """Returns a copy that shares nothing with this one."""
        return self.__deepcopy__({})

    def do_value(self, t: Scalar) -> np.ndarray:
        """The matrix at time t; a derived class defines it."""
        raise _pure("do_value")

    def do_rows(self) -> int:
        """The number of rows; a derived class defines it."""
        raise _pure("do_rows")

    def do_cols(self) -> int:
        """The number of columns; a derived class defines it."""
        raise _pure("do_cols")

    def do_start_time(self) -> float:
        """The first time; a derived class defines it."""
        raise _pure("do_start_time")

    def do_end_time(self) -> float:
        """The last time; a derived class defines it."""
        raise _pure("do_end_time")

    def do_has_derivative(self) -> bool:
        """Whether there are derivatives; a derived class defines it."""
        raise _pure("do_has_derivative")

    def DoEvalDerivative(self, t: Scalar, derivative_order: int) -> np.ndarray:
        """The derivative at time t; a derived class may define it."""
        raise _pure("DoEvalDerivative")

    def DoMakeDerivative(self, derivative_order: int) -> Trajectory:
        """The derivative as a trajectory; a derived class may define it."""
        raise _pure("DoMakeDerivative")

    def __copy__(self) -> Trajectory:
        return self.__deepcopy__({})

    def __deepcopy__(self, memo: dict) -> Trajectory:
        new = object.__new__(type(self))
        copied = _own if _is_ours(self) else _copied
        vars(new).update({name: copied(value) for name, value in self.__getstate__().items()})
        return new

    def __getstate__(self) -> dict:
        return {name: value for name, value in vars(self).items() if name not in ("_queries", "_times_asked")}

    @classmethod
    def _name(cls, call: str) -> str:
        return f"{pretty_class_name(cls)}.{call}()" if call else f"{pretty_class_name(cls)}()"

    @classmethod
    def _mismatch(cls, call: str, expected: str, given: object) -> TypeError:
        kind = "function" if call else "constructor"
        return TypeError(f"{cls._name(call)}: incompatible {kind} arguments; expected {expected}, got {given!r}.")

    @classmethod
    def _scalar(cls, call: str, t: Scalar) -> Any:
        if cls._T is float and isinstance(t, float):
            return float(t)  # no longer NumPy's, with which sums take five times as long
        try:
            return as_scalar(cls._T, t.item() if isinstance(t, np.ndarray) and t.ndim == 0 else t)
        except Mismatch:
            raise cls._mismatch(call, f"a number of type {cls._T.__name__}", t) from None

    @classmethod
    def _whole(cls, call: str, number: Any) -> int:
        """A whole number; one of Python's or NumPy's, never a float that happens to be whole."""
        try:
            return operator.index(number)
        except TypeError:
            raise cls._mismatch(call, "a whole number", number) from None

    @classmethod
    def _scalars(cls, call: str, t: Any) -> list:
        if isinstance(t, np.ndarray) and t.ndim == 2 and 1 in t.shape:
            t = t.ravel()
        if isinstance(t, (str, bytes)) or not hasattr(t, "__len__") or (isinstance(t, np.ndarray) and t.ndim != 1):
            raise cls._mismatch(call, f"a list of {cls._T.__name__}", t)
        if cls._T is float and isinstance(t, np.ndarray) and t.dtype is _FLOAT64:
            return t.tolist()
        if cls._T is float and all([type(x) is float for x in t]):
            return list(t)
        return [cls._scalar(call, x) for x in t]

    @classmethod
    def _matrix(cls, call: str, value: Scalars) -> np.ndarray:
        try:
            array = any_array(cls._T, value)
        except Mismatch:
            raise cls._mismatch(call, f"a matrix of {cls._T.__name__}", value) from None
        if array.ndim == 1:
            array = array.reshape(-1, 1)
        if array.ndim != 2:
            raise cls._mismatch(call, "a vector or a matrix", value)
        return array

    @classmethod
    def _zeros(cls, *shape: int) -> np.ndarray:
        return np.zeros(shape) if cls._T is float else any_array(cls._T, np.zeros(shape))

    @classmethod
    def _sibling(cls, template: ScalarTemplate) -> Any:
        """The class of the same scalar type in another family."""
        return template[cls._T]


def _own(value: object) -> Any:
    """What a copy of a trajectory of ours has: these put new arrays in the place of others, and write into none."""
    if type(value) is list:
        return [kept(v) for v in value] if value and isinstance(value[0], Trajectory) else value.copy()
    return kept(value) if isinstance(value, Trajectory) else value


def _copied(value: object) -> Any:
    """What a copy of a user's trajectory has: arrays, lists and other trajectories are copied, all else is a value."""
    if isinstance(value, np.ndarray):
        return value.copy()
    if isinstance(value, list):
        return [v if type(v) is float else _copied(v) for v in value]
    return kept(value) if isinstance(value, Trajectory) else value


def kept(trajectory: Trajectory) -> Any:
    """A trajectory to keep: a copy of ours, which may be changed by its owner, and a user's own as it is."""
    return trajectory.Clone() if _is_ours(trajectory) else trajectory


def _is_ours(trajectory: Trajectory) -> bool:
    cls = type(trajectory)
    ours = _OURS.get(cls)
    if ours is None:
        ours = _OURS[cls] = getattr(cls, "__module__", "").startswith("sheldrake.")
    return ours


_OURS: weakref.WeakKeyDictionary[type, bool] = weakref.WeakKeyDictionary()


def holds(condition: object) -> bool:
    """The truth of a comparison; of expressions, which must be numbers for that."""
    if type(condition) is bool:
        return condition
    return condition.Evaluate() if hasattr(condition, "Evaluate") else bool(condition)


def _order(call: str, order: int) -> int:
    order = Trajectory._whole(call, order)
    if order < 0:
        raise RuntimeError(f"Trajectory.{call}(): the order of the derivative must not be negative, got {order}.")
    return order


def no_derivatives() -> RuntimeError:
    """The error of classes that have no derivatives."""
    return RuntimeError("You asked for derivatives from a class that does not support derivatives.")


def query(kernel: Kernel, *args: KernelArgument, out: np.ndarray) -> Query | None:
    """A query of a kernel that is given t and fills `out`; None where another thread could come between."""
    from sheldrake.common._native import builtin
    from sheldrake.common.calls import Calls

    calls = Calls(_NEVER)
    if not (calls.native and builtin.available()):
        return None
    return calls.query(kernel, *args, out, given=("t",), answer=out)


def query_of_many(kernel: Kernel, *args: np.ndarray, shape: tuple[int, int]) -> Query | None:
    """A query of a kernel that is given times and fills a row for each element; None where there is no native code.

    Args:
        kernel: The kernel.
        args: What comes before times.
        shape: Of a value: a column or a row.
    """
    from sheldrake.common import quick

    ask, size, column = quick.query(kernel, *args, takes=(quick.ANY, quick.ANY), gives=bool), max(shape), shape[1] == 1

    def values(times: Any) -> np.ndarray | None:
        if type(times) is not np.ndarray or times.ndim != 1:
            return None
        out = np.empty((size, times.size))
        if ask(times, out.reshape(-1)) is None:
            return None
        return out if column else out.T

    return values if ask is not None else None


_NEVER = np.zeros(1, np.int64)
