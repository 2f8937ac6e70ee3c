"""What parameters take by their annotations, and the error for an argument that its parameter does not take.

Before a call begins only that is refused which is none of what an annotation names (`test_of`); of a call that failed,
arguments are looked at more closely (`refusal`): items of sequences, arrays that are numbers, numbers that are arrays.
"""

from __future__ import annotations

import ast
import inspect
import re
import sys
from collections.abc import Callable, Iterator
from types import FrameType
from typing import Any, TypeVar

import numpy as np

from sheldrake.common._overloads import Mismatch, describe, name_of_call

Test = Callable[[Any], bool]
STUMBLES = (
    ArithmeticError,
    AttributeError,
    LookupError,
    NotImplementedError,
    RuntimeError,
    StopIteration,
    ValueError,
)
"""What code of the library raises over arguments that it was not written for."""


def test_of(annotation: object, function: Callable[..., Any], more_names: dict[str, Any] | None = None) -> Test | None:
    """What an annotation of a function asks of an argument, None if nothing; its names are its module's, and more."""
    if annotation is inspect.Parameter.empty:
        return None
    names = getattr(inspect.unwrap(function), "__globals__", {})
    members = list(_members(annotation, {**more_names, **names} if more_names else names))
    if Any in members or object in members:
        return None
    takes_none = None in members
    tests = [_takes(member) for member in members if member is not None]
    if _not_none in tests:
        return None if takes_none else _not_none
    if len(tests) == 1:
        return tests[0] if not takes_none else is_number_or_none if tests[0] is is_number else _or_none(tests[0])
    return lambda value: takes_none if value is None else any(test(value) for test in tests)


def _or_none(test: Test) -> Test:
    return lambda value: value is None or test(value)


def _members(annotation: Any, names: dict[str, Any]) -> Iterator[Any]:
    """What a union is of; the annotation itself where it is none. `...` stands for what is unknown when code runs."""
    if isinstance(annotation, TypeVar):
        annotation = annotation.__bound__ or Any
    if not isinstance(annotation, str):
        yield from getattr(annotation, "__args__", [annotation]) if _is_union(annotation) else [annotation]
        return
    tree = ast.parse(annotation, mode="eval").body
    if isinstance(tree, ast.BinOp) and isinstance(tree.op, ast.BitOr):
        yield from _members(ast.unparse(tree.left), names)
        yield from _members(ast.unparse(tree.right), names)
        return
    code = compile(ast.Expression(tree), "<annotation>", "eval")
    try:
        value = eval(code, names)
    except (NameError, AttributeError):
        is_class = isinstance(tree, ast.Name) and annotation not in _ARRAYS
        value = _classes_named_in(annotation).get(annotation, ...) if is_class else ...
    yield from _members(value, names) if _is_union(value) or isinstance(value, TypeVar) else [value]


def _is_union(value: object) -> bool:
    return type(value).__name__ in ("Union", "UnionType", "_UnionGenericAlias")


def _takes(member: object) -> Test:
    if member is float:
        return is_number
    if member is bool:
        return _has_truth
    if member is int:
        return _is_whole
    if not isinstance(member, type) or member is np.ndarray:  # lists become arrays
        return _not_none
    if hasattr(member, "__index__") and not hasattr(member, "__members__"):
        # a plain number is one of any kind of things, a number of other things is not
        return lambda value: isinstance(value, (member, int, np.integer))
    template = vars(member).get("_template")
    if template is None:
        return lambda value: isinstance(value, member)
    return lambda value: isinstance(value, member) or _is_of(type(value), template)  # on any scalar


def _is_of(cls: type, template: object) -> bool:
    return any(vars(base).get("_template") is template for base in cls.__mro__)


def _not_none(value: object) -> bool:
    return value is not None


def _has_truth(value: Any) -> bool:
    """Whether a value counts as one of a flag, as in pydrake: numbers and None do."""
    return value is None or (isinstance(value, (complex, float, int, np.generic, np.ndarray)) and np.size(value) == 1)


def _is_whole(value: Any) -> bool:
    has_index = hasattr(type(value), "__index__") or isinstance(value, np.bool_)
    return has_index and (not isinstance(value, np.ndarray) or value.ndim == 0)


def is_number(value: Any) -> bool:
    """Whether a value is a number, or a dual or symbol that stands for one: what can be added to a number."""
    if isinstance(value, np.ndarray):
        return value.ndim == 0
    T = type(value)
    return any(hasattr(T, does) for does in ("__float__", "__radd__", "__index__")) and not isinstance(value, complex)


def is_number_or_none(value: Any) -> bool:
    return value is None or is_number(value)


def early_refusal(call: Callable[..., Any], args: tuple[Any, ...], kwargs: dict[str, Any]) -> Mismatch:
    """The error for arguments one of which `test_of` refuses."""
    signature = inspect.signature(call)
    try:
        given = signature.bind_partial(*args, **kwargs).arguments
    except TypeError as error:  # a name that is none of its parameters'
        return Mismatch(f"{name_of_call(call, *args[:1])}() {error}")
    for name, value in given.items():
        parameter = signature.parameters[name]
        test = test_of(parameter.annotation, call)
        values = value if parameter.kind is parameter.VAR_POSITIONAL else (value,)
        wrong = [v for v in values if test is not None and not test(v)]
        if wrong and parameter.kind is not parameter.VAR_KEYWORD:
            return _mismatch(call, args, f"{name} must be {_shown(parameter.annotation, call)}, not", wrong[0])
    raise AssertionError("an argument was refused that none of its parameters refuses")


def refusal(
    function: Callable[..., Any], args: tuple[Any, ...], kwargs: dict[str, Any], error: BaseException
) -> Mismatch | None:
    """The error for arguments of a failed call that are not what its parameters take; None if they are."""
    frame = _innermost(error)
    ours = frame is not None and frame.f_globals.get("__name__", "").partition(".")[0] in _LIBRARIES
    if not ours and (frame is None or frame.f_code is not inspect.unwrap(function).__code__):
        return None  # a function of the caller's stumbled
    no_formulas = frame is not None and frame.f_code.co_name == "__bool__"  # as those about symbols for numbers are
    shape = _unfit_shape(error) if ours else None
    stumbled_over = [error.obj] if ours and isinstance(error, AttributeError) and error.name is not None else []
    for parameter, value in _given(function, args, kwargs):
        if value is parameter.default or (value is None and _may_be_stated(error)):
            continue
        one_of_many = parameter.kind is parameter.VAR_POSITIONAL  # which may be the numbers of an array
        test = (test_of if one_of_many else strict_test_of)(parameter.annotation, function)
        if (test is not None and not test(value)) or (no_formulas and _is_a_symbol_for_a_number(parameter, value)):
            wanted = f"must be {_shown(parameter.annotation, function)}, not"
        elif any(value is thing for thing in stumbled_over) and (test is None or test(_UNKNOWN)):
            wanted = "cannot be"
        elif shape is not None and _is_array(value) and np.size(value) == shape[0]:
            wanted = f"must be an array of shape {shape[1]}, not"
        else:
            continue
        return _mismatch(function, args, f"{parameter.name} {wanted}", value)
    return None


def _unfit_shape(error: BaseException) -> tuple[int, str] | None:
    """The size of an array, and the shape that it was to have, where it has too many numbers or too few."""
    found = re.fullmatch(r"cannot reshape array of size (\d+) into shape (\([\d,]+\))", str(error))
    return None if found is None else (int(found[1]), found[2])


def _is_a_symbol_for_a_number(parameter: inspect.Parameter, value: object) -> bool:
    return parameter.annotation in ("float", "float | None") and type(value).__module__.startswith("sheldrake.symbolic")


def _shown(annotation: object, function: Callable[..., Any]) -> object:
    """An annotation as errors show it."""
    if isinstance(annotation, str):
        variable = getattr(inspect.unwrap(function), "__globals__", {}).get(annotation)
        annotation = variable.__bound__ if isinstance(variable, TypeVar) else annotation
    return annotation if isinstance(annotation, str) else getattr(annotation, "__name__", annotation)


def _mismatch(call: Callable[..., Any], args: tuple[Any, ...], what: str, value: Any) -> Mismatch:
    found = "None" if value is None else describe(value)
    return Mismatch(f"{name_of_call(call, *args[:1])}(): incompatible function arguments. {what} {found}.")


def _may_be_stated(error: BaseException) -> bool:
    """Whether an error may be what the library says of None, which pydrake takes for a pointer to nothing."""
    return isinstance(error, RuntimeError) or " is None" in str(error)


def _innermost(error: BaseException) -> FrameType | None:
    """Where it was raised."""
    trace = error.__traceback__
    while trace is not None and trace.tb_next is not None:
        trace = trace.tb_next
    return None if trace is None else trace.tb_frame


_LIBRARIES = ("sheldrake", "numpy", "scipy")
_UNKNOWN = object()  # what passes with this has been tested for little


def _given(
    function: Callable[..., Any], args: tuple[Any, ...], kwargs: dict[str, Any]
) -> Iterator[tuple[inspect.Parameter, Any]]:
    signature = inspect.signature(function)
    for name, value in signature.bind(*args, **kwargs).arguments.items():
        parameter = signature.parameters[name]
        if parameter.kind is parameter.VAR_POSITIONAL:
            yield from ((parameter, v) for v in value)
        elif parameter.kind is not parameter.VAR_KEYWORD:
            yield parameter, value


_NEVER = (str, bytes, dict, set, type(None))
_ARRAYS = ("ArrayLike", "np.ndarray", "Scalars", "Symbolics", "Vector")
_SEQUENCES = ("Sequence", "list", "Iterable", "Collection")


def strict_test_of(annotation: object, function: Callable[..., Any]) -> Test | None:
    """What an annotation asks of an argument of a call that failed; None if nothing."""
    if not isinstance(annotation, str):
        return test_of(annotation, function)
    tests: list[Test] = []
    for part in _parts(ast.parse(annotation, mode="eval").body):
        name, _, inner = part.partition("[")
        if name in _ARRAYS:
            tests.append(_is_array)
        elif name in _SEQUENCES and inner:
            tests.append(_sequence_test(strict_test_of(inner[:-1], function)))
        elif name == "Callable":
            tests.append(callable)
        elif part == "int":
            tests.append(_is_whole_of_machine)
        elif part in ("Expression", "Scalar"):  # numbers, variables and polynomials become one
            tests.append(is_number)
        elif part in ("Formula", "Polynomial"):
            tests.append(lambda value: not isinstance(value, _NEVER))
        else:
            test = test_of(part, function, _classes_named_in(part))
            if test is None and part != "None":
                return None
            tests.append(test or _is_none)
    return lambda value: any(test(value) for test in tests)


def _parts(union: ast.expr) -> Iterator[str]:
    if isinstance(union, ast.BinOp) and isinstance(union.op, ast.BitOr):
        yield from _parts(union.left)
        yield from _parts(union.right)
    else:
        yield ast.unparse(union)


def _is_whole_of_machine(value: Any) -> bool:
    return _is_whole(value) and -(2**63) <= value < 2**64


def _is_none(value: object) -> bool:
    return value is None


def _is_array(value: Any) -> bool:
    if isinstance(value, np.ndarray):
        return value.ndim > 0 and value.dtype.kind not in "SU"
    if isinstance(value, (list, tuple)):
        return all(is_number(item) or _is_array(item) for item in value)
    return not isinstance(value, _NEVER) and (
        hasattr(value, "__array__") or hasattr(value, "__len__") or value is _UNKNOWN
    )


def _sequence_test(of_item: Test | None) -> Test:
    def test(value: Any) -> bool:
        if not isinstance(value, (list, tuple)):  # what else can be walked may be walked once
            return hasattr(value, "__iter__") and not isinstance(value, (str, bytes))
        return of_item is None or all(map(of_item, value))

    return test


def _classes_named_in(annotation: str) -> dict[str, Any]:
    """Public classes of the library by the names in an annotation, which a module may know for type checkers alone."""
    found: dict[str, set[Any]] = {name: set() for name in re.findall(r"\w+", annotation)}
    for module in [m for name, m in sys.modules.items() if name.startswith("sheldrake.") and "._" not in name]:
        for name, meanings in found.items():
            if (meaning := vars(module).get(name)) is not None:
                meanings.add(meaning if _is_class_of_ours(meaning) else ...)
    return {name: meanings.pop() for name, meanings in found.items() if len(meanings) == 1 and ... not in meanings}


def _is_class_of_ours(thing: object) -> bool:
    return isinstance(thing, type) and thing.__module__.startswith("sheldrake") and not vars(thing).get("_is_protocol")
