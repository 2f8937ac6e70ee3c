"""Variables and sets of them.

A variable is an identity number with a name; two of the same name are two variables.
"""

from __future__ import annotations

import itertools
import operator
from collections.abc import Iterable, Iterator
from typing import Any

import numpy as np

from sheldrake.common._checked import checked
from sheldrake.common._kinds import LARGEST_COUNT
from sheldrake.common._overloads import Mismatch
from sheldrake.symbolic._kinds import VariableType
from sheldrake.symbolic._operators import Operators

_ids = itertools.count(1)


def number_of_last() -> int:
    """The number of the last variable made in this process; one is left out."""
    return next(_ids)


_DUMMY: Any = object()

_TYPE_WORDS = {t: t.name.replace("_", " ").title() for t in VariableType}


class Variable(Operators):
    """A variable: a name to print and an identity of its own. Two variables of one name are two variables.

    Args:
        name: How it prints; left out for a dummy, which stands for no variable at all.
        type: What values it takes.
    """

    __slots__ = ("__weakref__", "_expression", "_id", "_name", "_type")
    _expression: Any
    Type = VariableType

    def __init__(self, name: str = _DUMMY, type: VariableType = VariableType.CONTINUOUS):
        is_dummy = name is _DUMMY
        name = "\N{MATHEMATICAL ITALIC SMALL X}" if is_dummy else name
        if not isinstance(name, str) or not isinstance(type, VariableType):
            raise TypeError(f"Variable(): expected (name: str, type: Variable.Type), got ({name!r}, {type!r}).")
        # The type is in the upper bits, as in Drake: continuous variables come before integer, binary and Boolean ones.
        self._id = 0 if is_dummy else next(_ids) | (type._value_ << 56)
        self._name, self._type = name, type
        self._expression = None

    def get_id(self) -> int:
        """Returns the number that tells this variable from all others; within a type it grows with creation."""
        return self._id

    def get_name(self) -> str:
        """Returns the name."""
        return self._name

    def get_type(self) -> VariableType:
        """Returns what values it takes."""
        return self._type

    def is_dummy(self) -> bool:
        """Tells whether this is no variable at all; never so for one that has a name."""
        return self._id == 0

    def EqualTo(self, other: Variable) -> bool:
        """Tells whether both are the same variable.

        Raises:
            TypeError: the other is no variable.
        """
        if not isinstance(other, Variable):
            raise Mismatch(f"Variable.EqualTo(): incompatible function arguments; expected a Variable, got {other!r}.")
        return self._id == other._id

    __hash__ = object.__hash__  # that of no other object: a dict would compare them, and comparing gives a formula

    def __copy__(self) -> Variable:
        return self

    def __deepcopy__(self, memo: dict) -> Variable:
        return self

    def __str__(self) -> str:
        return self._name

    def __repr__(self) -> str:
        return f"Variable('{self._name}', {_TYPE_WORDS[self._type]})"


_age = operator.attrgetter("_id")
VariableType.__name__, VariableType.__qualname__ = "Type", "Variable.Type"


class Variables:
    """A set of variables, in the order of their creation.

    Args:
        variables: Variables, in any order, repeated or not.
    """

    __slots__ = ("_set",)

    def __init__(self, variables: Iterable[Variable] = ()):
        self._set: dict[int, Variable]
        if isinstance(variables, Variables):
            self._set = variables._set.copy()
            return
        items = list(variables.ravel() if isinstance(variables, np.ndarray) else variables)
        for v in items:
            if not isinstance(v, Variable):
                raise Mismatch(f"Variables(): incompatible constructor arguments; expected variables, got {v!r}.")
        if len(items) > 1:
            items.sort(key=_age)
        self._set = {v._id: v for v in items}

    @classmethod
    def _of(cls, variables: Iterable[Variable]) -> Variables:
        """That of what are known to be variables."""
        out = object.__new__(cls)
        out._set = {v._id: v for v in sorted(variables, key=_age)}
        return out

    def size(self) -> int:
        """Returns how many there are."""
        return len(self._set)

    def empty(self) -> bool:
        """Tells whether there is none."""
        return not self._set

    def insert(self, var: Any = None, *, vars: Any = None) -> None:
        """Adds a variable, or all of another set."""
        given = var if vars is None else vars
        self._set = (self + given)._set

    def erase(self, key: Any = None, *, vars: Any = None) -> int:
        """Takes out a variable, or all of another set; returns how many were there."""
        given = key if vars is None else vars
        before = len(self._set)
        self._set = (self - given)._set
        return before - len(self._set)

    @checked
    def include(self, key: Variable) -> bool:
        """Tells whether the variable is in the set."""
        return key in self

    @checked
    def IsSubsetOf(self, vars: Variables) -> bool:
        """Tells whether each of these is in the other set."""
        return self._set.keys() <= vars._set.keys()

    @checked
    def IsSupersetOf(self, vars: Variables) -> bool:
        """Tells whether each of the other set is in this one."""
        return self._set.keys() >= vars._set.keys()

    @checked
    def IsStrictSubsetOf(self, vars: Variables) -> bool:
        """Tells whether each of these is in the other set, and more."""
        return self._set.keys() < vars._set.keys()

    @checked
    def IsStrictSupersetOf(self, vars: Variables) -> bool:
        """Tells whether each of the other set is in this one, and more."""
        return self._set.keys() > vars._set.keys()

    @checked
    def EqualTo(self, other: Variables) -> bool:
        """Tells whether both hold the same variables."""
        return self._set.keys() == other._set.keys()

    def to_string(self) -> str:
        """Returns the names in braces."""
        return str(self)

    def __len__(self) -> int:
        return len(self._set)

    def __iter__(self) -> Iterator[Variable]:
        return iter(tuple(self._set.values()))

    def __contains__(self, key: Variable | Variables | None) -> bool:
        return isinstance(key, Variable) and key._id in self._set

    def __eq__(self, other: object) -> bool:
        return self.EqualTo(other) if isinstance(other, Variables) else NotImplemented

    def __lt__(self, other: Variables) -> bool:
        return list(self._set) < list(other._set)

    def __reduce__(self) -> tuple:
        return Variables, (list(self._set.values()),)

    def __hash__(self) -> int:
        return hash(("sheldrake.symbolic.Variables", *self._set))

    def __add__(self, other: Variables | Variable) -> Variables:
        if isinstance(other, Variable):
            return Variables._of([*self, other])
        return Variables._of([*self, *other]) if isinstance(other, Variables) else NotImplemented

    def __radd__(self, other: Variables | Variable) -> Variables:
        return Variables._of([*self, other]) if isinstance(other, Variable) else NotImplemented

    def __sub__(self, other: Variables | Variable) -> Variables:
        if isinstance(other, Variable):
            return Variables._of([v for v in self if v is not other])
        return Variables._of([v for v in self if v not in other]) if isinstance(other, Variables) else NotImplemented

    def __copy__(self) -> Variables:
        out = object.__new__(Variables)
        out._set = self._set.copy()
        return out

    def __deepcopy__(self, memo: dict) -> Variables:
        return self.__copy__()

    def __str__(self) -> str:
        return "{" + ", ".join(v._name for v in self) + "}"

    def __repr__(self) -> str:
        return f'<Variables "{self}">'


def intersect(vars1: Variables, vars2: Variables) -> Variables:
    """Returns the variables that are in both sets."""
    return Variables([v for v in vars1 if v in vars2])


def named(names: Iterable[str], type: VariableType) -> list[Variable]:
    """New variables of these names."""
    out, kind, new, cls = [], type._value_ << 56, object.__new__, Variable
    for name, number in zip(names, _ids):
        v = new(cls)
        v._id, v._name, v._type, v._expression = number | kind, name, type, None
        out.append(v)
    return out


def _make(size: tuple[int, ...], name: str, type: VariableType) -> np.ndarray:
    if not isinstance(name, str) or not isinstance(type, VariableType):
        raise TypeError(f"expected (name: str, type: Variable.Type), got ({name!r}, {type!r}).")
    size = tuple(map(operator.index, size))
    if min(size) < 0:
        raise ValueError(f"new variables {name!r}: numbers of rows and columns must not be negative, got {size}.")
    if max(size) > LARGEST_COUNT:
        raise Mismatch(f"new variables {name!r}: numbers of rows and columns are at most {LARGEST_COUNT}, not {size}.")
    if len(size) == 1:
        names = [f"{name}({i})" for i in range(size[0])]
    else:
        names = [f"{name}({i}, {j})" for i in range(size[0]) for j in range(size[1])]
    return np.fromiter(named(names, type), object, len(names)).reshape(size)


def MakeVectorVariable(rows: int, name: str, type: VariableType = VariableType.CONTINUOUS) -> np.ndarray:
    """Returns `rows` new variables name(0), name(1) ..., shape `(rows,)`."""
    return _make((rows,), name, type)


def MakeVectorContinuousVariable(rows: int, name: str) -> np.ndarray:
    """Returns `rows` new continuous variables, shape `(rows,)`."""
    return _make((rows,), name, VariableType.CONTINUOUS)


def MakeVectorBinaryVariable(rows: int, name: str) -> np.ndarray:
    """Returns `rows` new variables that are 0 or 1, shape `(rows,)`."""
    return _make((rows,), name, VariableType.BINARY)


def MakeVectorBooleanVariable(rows: int, name: str) -> np.ndarray:
    """Returns `rows` new variables that are true or false, shape `(rows,)`."""
    return _make((rows,), name, VariableType.BOOLEAN)


def MakeMatrixVariable(rows: int, cols: int, name: str, type: VariableType = VariableType.CONTINUOUS) -> np.ndarray:
    """Returns new variables name(0, 0), name(0, 1) ..., shape `(rows, cols)`."""
    return _make((rows, cols), name, type)


def MakeMatrixContinuousVariable(rows: int, cols: int, name: str) -> np.ndarray:
    """Returns new continuous variables, shape `(rows, cols)`."""
    return _make((rows, cols), name, VariableType.CONTINUOUS)


def MakeMatrixBinaryVariable(rows: int, cols: int, name: str) -> np.ndarray:
    """Returns new variables that are 0 or 1, shape `(rows, cols)`."""
    return _make((rows, cols), name, VariableType.BINARY)


def MakeMatrixBooleanVariable(rows: int, cols: int, name: str) -> np.ndarray:
    """Returns new variables that are true or false, shape `(rows, cols)`."""
    return _make((rows, cols), name, VariableType.BOOLEAN)
