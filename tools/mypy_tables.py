"""Tells mypy what `table` (`sheldrake.common.record`) gives a NamedTuple: the names of its records, and rows."""

from __future__ import annotations

from collections.abc import Callable

from mypy.nodes import ARG_POS, Argument, Var
from mypy.plugin import ClassDefContext, Plugin
from mypy.plugins.common import add_method_to_class
from mypy.types import AnyType, NoneType, TypeOfAny

TABLE = "sheldrake.common.record.table"


def _add_names(ctx: ClassDefContext) -> None:
    anything = AnyType(TypeOfAny.explicit)
    text = ctx.api.named_type("builtins.str")

    def argument(name: str, kind: object) -> Argument:
        return Argument(Var(name, kind), kind, None, ARG_POS)  # type: ignore[arg-type]

    for method, arguments, result in (
        ("__getattr__", [argument("name", text)], anything),
        ("__setattr__", [argument("name", text), argument("value", anything)], NoneType()),
        ("__getitem__", [argument("i", anything)], anything),
    ):
        add_method_to_class(ctx.api, ctx.cls, method, arguments, result)
    if items := ctx.cls.info.tuple_type:  # which mypy asks first what `table[i]` is
        ctx.cls.info.update_tuple_type(items.copy_modified(items=[anything] * len(items.items)))


class Tables(Plugin):
    """Makes the names of a table's records attributes of any type."""

    def get_class_decorator_hook(self, fullname: str) -> Callable[[ClassDefContext], None] | None:
        """What mypy asks for each decorator of a class."""
        return _add_names if fullname == TABLE else None


def plugin(version: str) -> type[Plugin]:
    """What mypy calls."""
    return Tables
