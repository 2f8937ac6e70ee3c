"""Vectors whose elements have names."""

from __future__ import annotations

import inspect
from typing import TYPE_CHECKING, Any, ClassVar

from sheldrake.systems.framework import BasicVector

if TYPE_CHECKING:
    from typing_extensions import Self


class NamedVector(BasicVector):
    """A BasicVector with `name()`, `set_name(value)` and `with_name(value)` for each of the class's elements."""

    _any_scalar = True

    elements: ClassVar[dict[str, float]] = {}
    """Names and default values, in order."""

    if TYPE_CHECKING:  # the accessors are made below

        def __getattr__(self, name: str) -> Any: ...

    def __init__(self) -> None:
        super().__init__(list(self.elements.values()))

    @classmethod
    def of(cls, vector: BasicVector) -> Self:
        """The same memory with the names of this class; contexts of other scalars have plain vectors.

        Raises:
            RuntimeError: it is of another size: from a context of another system.
        """
        if isinstance(vector, cls):
            return vector
        if len(vector._v) != len(cls.elements):
            raise RuntimeError(
                f"{cls.__name__}: the Context has a vector of size {len(vector._v)} where {len(cls.elements)} are "
                "expected; it is of another System."
            )
        return cls()._on_memory(vector._v, vector._on_write)

    def __init_subclass__(cls, **kwargs: object) -> None:
        super().__init_subclass__(**kwargs)
        for index, name in enumerate(cls.elements):
            _add_accessors(cls, index, name)


def _add_accessors(cls: type, index: int, name: str) -> None:
    self_, value = (inspect.Parameter(n, inspect.Parameter.POSITIONAL_OR_KEYWORD) for n in ("self", name))
    signature = inspect.Signature([self_, value])

    def get(self: Any) -> Any:
        return self[index]

    def set_(*args: Any, **kwargs: Any) -> None:
        given = signature.bind(*args, **kwargs).arguments
        given["self"][index] = given[name]

    def with_(*args: Any, **kwargs: Any) -> Any:
        given = signature.bind(*args, **kwargs).arguments
        changed = given["self"].Clone()
        changed[index] = given[name]
        return changed

    accessors: tuple[tuple[Any, str, str], ...] = (
        (get, name, f"The element {name}."),
        (set_, f"set_{name}", f"Sets the element {name}."),
        (with_, f"with_{name}", f"A copy with another {name}."),
    )
    for function, called, text in accessors:
        function.__name__, function.__qualname__, function.__doc__ = called, f"{cls.__qualname__}.{called}", text
        if function is not get:
            function.__signature__ = signature
        setattr(cls, called, function)
