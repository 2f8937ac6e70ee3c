"""Names of solvers, options for them, and what they say of programs and results."""

from __future__ import annotations

import copy
import operator
from collections.abc import Callable, Mapping
from types import SimpleNamespace
from typing import Any

import numpy as np

from sheldrake.common._enums import BoundEnum, NumberEnum
from sheldrake.common._kinds import instance_of, text
from sheldrake.common._overloads import Mismatch, incompatible, kind, overload, overloaded


class SolverType(BoundEnum):
    """Solvers that have a number."""

    kClp = 0
    kCsdp = 1
    kEqualityConstrainedQP = 2
    kGurobi = 3
    kIpopt = 4
    kLinearSystem = 5
    kMobyLCP = 6
    kMosek = 7
    kNlopt = 8
    kOsqp = 9
    kSnopt = 10
    kScs = 11
    kUnrevisedLemke = 12


class CommonSolverOption(BoundEnum):
    """Options that mean the same for all solvers."""

    kPrintFileName = 0
    kPrintToConsole = 1
    kStandaloneReproductionFileName = 2
    kMaxThreads = 3


class ProgramAttribute(BoundEnum):
    """What a program may have that a solver must know how to handle."""

    kGenericCost = 0
    kGenericConstraint = 1
    kQuadraticCost = 2
    kQuadraticConstraint = 3
    kLinearCost = 4
    kLinearConstraint = 5
    kLinearEqualityConstraint = 6
    kLinearComplementarityConstraint = 7
    kLorentzConeConstraint = 8
    kRotatedLorentzConeConstraint = 9
    kPositiveSemidefiniteConstraint = 10
    kExponentialConeConstraint = 11
    kL2NormCost = 12
    kBinaryVariable = 13
    kCallback = 14


class ProgramType(BoundEnum):
    """Families of programs."""

    kLP = 0
    kQP = 1
    kSOCP = 2
    kSDP = 3
    kGP = 4
    kCGP = 5
    kMILP = 6
    kMIQP = 7
    kMISOCP = 8
    kMISDP = 9
    kQuadraticCostConicConstraint = 10
    kNLP = 11
    kLCP = 12
    kUnknown = 13


class SolutionResult(NumberEnum):
    """How a solve ended."""

    kSolutionFound = 0
    kInvalidInput = -1
    kInfeasibleConstraints = -2
    kUnbounded = -3
    kSolverSpecificError = -4
    kInfeasibleOrUnbounded = -5
    kIterationLimit = -6
    kDualInfeasible = -7
    kSolutionResultNotSet = -8


class SolverId:
    """The name of a solver.

    Args:
        name: How it prints.
    """

    __slots__ = ("_name",)

    def __init__(self, name: str):
        if not isinstance(name, str):
            raise incompatible("SolverId", ["(name: str)"], (name,), {}, constructor=True)
        self._name = name

    def name(self) -> str:
        """Returns the name."""
        return self._name

    def __eq__(self, other: object) -> bool:
        return self._name == other._name if isinstance(other, SolverId) else NotImplemented

    def __hash__(self) -> int:
        return hash(("SolverId", self._name))

    def __lt__(self, other: SolverId) -> bool:
        return self._name < other._name


_TYPE_NAMES = {
    SolverType.kClp: "Clp",
    SolverType.kCsdp: "CSDP",
    SolverType.kEqualityConstrainedQP: "EqConstrainedQP",
    SolverType.kGurobi: "Gurobi",
    SolverType.kIpopt: "Ipopt",
    SolverType.kLinearSystem: "Linear system",
    SolverType.kMobyLCP: "Moby LCP",
    SolverType.kMosek: "MOSEK",
    SolverType.kNlopt: "NLopt",
    SolverType.kOsqp: "OSQP",
    SolverType.kSnopt: "SNOPT",
    SolverType.kScs: "SCS",
    SolverType.kUnrevisedLemke: "Unrevised Lemke",
}


def solver_type_of(solver_id: SolverId) -> SolverType | None:
    """The number of a solver, if it has one."""
    return next((t for t, name in _TYPE_NAMES.items() if name == solver_id.name()), None)


def id_of_type(solver_type: SolverType) -> SolverId:
    """The name of a numbered solver."""
    return SolverId(_TYPE_NAMES[solver_type])


_COMMON = "Drake"  # The name under which options that all solvers understand are kept.


@kind("float | int | str", takes=(float, int, str))
def option_value(value: Any) -> float | int | str:
    """Kind: a value of an option, as plain Python; what has an index an int, other numbers floats."""
    if isinstance(value, (float, str)):
        return value.item() if isinstance(value, np.generic) else value
    try:
        return operator.index(value)
    except TypeError:
        pass
    try:
        return float(value)
    except (TypeError, ValueError):
        raise Mismatch from None


def _checked_options(values: Any) -> dict[str, dict[str, Any]]:
    """A copy of options by solver and name, in which each is what an option may be."""
    if not isinstance(values, Mapping) or not all([isinstance(of_one, Mapping) for of_one in values.values()]):
        raise Mismatch(f"SolverOptions.options: expected a dict of dicts, got {values!r}.")
    found = {
        solver: {key: _checked_option(key, value) for key, value in of_one.items()} for solver, of_one in values.items()
    }
    if not all([isinstance(solver, str) for solver in found]):
        raise Mismatch(f"SolverOptions.options: names of solvers are str, got {list(found)}.")
    return found


def _checked_option(key: Any, value: Any) -> float | int | str:
    if not isinstance(key, str):
        raise Mismatch(f"SolverOptions.options: names of options are str, got {key!r}.")
    try:
        return option_value(value)
    except Mismatch:
        raise Mismatch(f"SolverOptions.options: the option {key!r} is a float, int or str, not {value!r}.") from None


class SolverOptions:
    """Options by name of solver and name of option.

    Args:
        options: Values by solver and name; those for all solvers are under the name "Drake". The attribute of this
            name gives a copy, and is set as a whole; `SetOption` sets one.

    Raises:
        TypeError: a name is no str, or a value neither a number nor a str.
    """

    __fields__ = (SimpleNamespace(name="options", type=dict[str, dict[str, "float | int | str"]]),)

    def __init__(self, options: dict[str, dict[str, Any]] | None = None):
        self._options: dict[str, dict[str, Any]] = {}
        if options:
            self.options = options

    @property
    def options(self) -> dict[str, dict[str, Any]]:
        """A copy of the values by solver and name."""
        return {solver: dict(of_one) for solver, of_one in self._options.items()}

    @options.setter
    def options(self, values: dict[str, dict[str, Any]]) -> None:
        self._options = _checked_options(values)

    @overloaded(
        overload(solver_id=instance_of(SolverId), key=text, value=option_value),
        overload(
            lambda self, *given: self._set_common(*given), key=instance_of(CommonSolverOption), value=option_value
        ),
    )
    def SetOption(self, solver_id: SolverId, key: str, value: float | int | str) -> None:
        """Sets one option; called as `SetOption(solver_id, key, value)` or `SetOption(CommonSolverOption, value)`.

        Raises:
            RuntimeError: the value does not fit a common option.
        """
        self._put(solver_id.name(), key, value)

    def _set_common(self, key: CommonSolverOption, value: Any) -> None:
        _check_common(key, value)
        self._put(_COMMON, key.name, value)

    def _put(self, solver: str, key: str, value: float | int | str) -> None:
        """Keeps one value; solvers and keys stay in alphabetical order."""
        self._options = _with(self._options, solver, _with(self._options.get(solver, {}), key, value))

    def _of(self, name: str) -> dict[str, Any]:
        """Returns the options of one solver."""
        return self._options.get(name, {})

    def _common(self, option: CommonSolverOption, default: Any = None) -> Any:
        """Returns the value of an option that all solvers understand."""
        return self._options.get(_COMMON, {}).get(option.name, default)

    def _merged(self, other: SolverOptions | None) -> SolverOptions:
        """Returns these options, and those of `other` in their place where it has them; to be read alone."""
        if other is None:
            return self
        out = SolverOptions()
        out._options = self.options
        for solver, values in other._options.items():
            out._options.setdefault(solver, {}).update(values)
        return out

    def __eq__(self, other: object) -> bool:
        return self._options == other._options if isinstance(other, SolverOptions) else NotImplemented

    __hash__ = None  # type: ignore[assignment]

    def __copy__(self) -> SolverOptions:
        return SolverOptions(self.options)

    def __deepcopy__(self, memo: dict) -> SolverOptions:
        return SolverOptions(copy.deepcopy(self.options, memo))

    def __repr__(self) -> str:
        ordered = {solver: dict(sorted(values.items())) for solver, values in sorted(self.options.items())}
        return f"SolverOptions(options={ordered})"


def _with(items: dict[str, Any], key: str, value: Any) -> dict[str, Any]:
    """A copy with a value, in alphabetical order of keys as the items are."""
    found = {**items, key: value}
    return found if key in items else dict(sorted(found.items()))


_COMMON_VALUES: dict[CommonSolverOption, tuple[Callable[[Any], bool], str]] = {
    CommonSolverOption.kPrintFileName: (lambda value: isinstance(value, str), "a string"),
    CommonSolverOption.kStandaloneReproductionFileName: (lambda value: isinstance(value, str), "a string"),
    CommonSolverOption.kPrintToConsole: (lambda value: not isinstance(value, str) and value in (0, 1), "0 or 1"),
    CommonSolverOption.kMaxThreads: (lambda value: isinstance(value, int) and value > 0, "an int > 0"),
}


def _check_common(option: CommonSolverOption, value: object) -> None:
    fits, expected = _COMMON_VALUES[option]
    if not fits(value):
        shown = f'"{value}"' if isinstance(value, str) else value
        raise RuntimeError(f"SolverOptions::SetOption({option.name}) value must be {expected}, not {shown}.")
