"""Contexts in files: what one process saves, another loads and goes on with, bit by bit as if it had never stopped."""

from __future__ import annotations

import json
import os
import zipfile
from typing import Any

import numpy as np

from sheldrake.common.value import AbstractValue
from sheldrake.systems.framework._engine.store import Store, tree_of

FORMAT = 1
_PLAIN = (bool, int, float, str, type(None))
_PARTS = {"S": np.float64, "I": np.int64, "L": np.float64}
_AS_DEFAULT = {"as": "default"}


def SaveContext(context: Any, path: str | os.PathLike) -> None:
    """Writes a root context (time, state, parameters, fixed inputs, logs) to a NumPy archive (.npz).

    Numbers are kept to the last bit. Abstract values may be numbers, strings, arrays, lists and dicts of these, and
    objects with methods `ToPlain()` (their content as such values) and `SetFromPlain(content)`; one of another type
    must still be as in the default context. Nothing in the file is code.

    A simulator of a loaded context goes on from where the saved run stopped: it does not initialize by itself, and an
    integrator of the same kind takes up its step size and matrices.

    Args:
        context: A root context of floats.
        path: The file.

    Raises:
        RuntimeError: the context is no root context, or not of floats.
        TypeError: an abstract value has a type that cannot be saved.
    """
    store: Store = context._store
    if context._node != 0:
        raise RuntimeError(
            f"SaveContext(): {context.GetSystemPathname()} is a subsystem; save the context of the root diagram."
        )
    if store.S.dtype != float:
        raise RuntimeError(f"SaveContext(): the context's scalar is {store.scalar.__name__}; only float can be saved.")
    arrays: list[np.ndarray] = []
    default: Store = store.systems[0].CreateDefaultContext()._store
    values = {
        "abstract": _encode_all(store, "abstract", default, arrays),
        "parameters": _encode_all(store, "parameters", default, arrays),
        "fixed": {str(k): _encode(_bare(v), arrays, f"fixed input {k}") for k, v in store.fixed.items()},
    }
    text = json.dumps(
        {
            "format": FORMAT,
            "structure": _structure(store),
            "overrides": sorted(store.layout.overrides),
            "accuracy": store.accuracy,
            "stopped": store.stopped,
            **values,
        },
        default=np.ndarray.tolist,
    )
    slab = {"S": store.S, "I": store.I, "L": store.L, **{f"array{k}": a for k, a in enumerate(arrays)}}
    with open(path, "wb") as file:
        np.savez(file, allow_pickle=False, meta=np.array(text), **slab)


def LoadContext(system: Any, path: str | os.PathLike) -> Any:
    """A context for `system` with what `SaveContext` wrote for a system built the same way.

    Args:
        system: The root system.
        path: The file.

    Raises:
        RuntimeError: the file is not one of SaveContext's, or was written for another system; the first difference is
            named.
    """
    meta, found = _read(os.fspath(path))
    overrides = frozenset((int(n), int(i)) for n, i in meta["overrides"])
    context = system.CreateDefaultContext()
    if overrides:
        context = Store(system._layout_with(overrides), tree_of(system), float).context(0)
        system.SetDefaultContext(context)
    store: Store = context._store
    _compare(meta["structure"], _structure(store), os.fspath(path))
    arrays = [found[f"array{k}"] for k in range(len(found) - len(_PARTS))]
    store.S[:], store.I[:], store.L = found["S"], found["I"], found["L"].copy()
    store.I[store.layout.stamp0 : store.layout.k0] = 0  # computed values are computed anew
    store.accuracy = meta["accuracy"]
    for values, saved in ((store.abstract, meta["abstract"]), (store.parameters, meta["parameters"])):
        for value, text in zip(values, saved):
            if "plain_of" in text:
                value.get_mutable_value().SetFromPlain(_decode(text["plain_of"], arrays))
            elif text != _AS_DEFAULT:
                value.set_value(_decode(text, arrays))
    store.fixed = {int(k): AbstractValue.Make(_decode(v, arrays)) for k, v in meta["fixed"].items()}
    store.out_of_date()
    store.settle()
    store.goes_on = None if meta["stopped"] is None else tuple(meta["stopped"])
    return context


def _read(path: str) -> tuple[dict, dict]:
    try:
        with np.load(path, allow_pickle=False) as archive:
            found = {name: archive[name] for name in archive.files}
        meta = json.loads(str(found.pop("meta")))
        if meta["format"] != FORMAT:
            raise ValueError(f"its format is {meta['format']}, not {FORMAT}")
        if not all(found[name].dtype == kind and found[name].ndim == 1 for name, kind in _PARTS.items()):
            raise ValueError("its arrays have other types")
    except FileNotFoundError:
        raise
    except (OSError, EOFError, LookupError, ValueError, TypeError, AttributeError, zipfile.BadZipFile) as error:
        raise RuntimeError(f"LoadContext(): {path} is no file of SaveContext(): {error}.") from error
    return meta, found


def _structure(store: Store) -> list:
    """What two systems must have in common for one's numbers to mean the same in the other."""
    layout, entries = store.layout, []
    for n in layout.leaves:
        system, place = store.systems[n], layout.places[n]
        sizes = {"xc": place.xc, "xd": place.xd, "p": place.p, "work": place.work, "abstract": place.abstract}
        numbers = {name: b - a for name, (a, b) in sizes.items()}
        numbers["inputs"], numbers["outputs"] = len(place.inputs), len(place.outputs)
        entries.append([store.context(n).GetSystemPathname(), type(system).__name__, numbers])
    return [*entries, ["memory", "numbers", {"slab": layout.size, "side": layout.side_size}]]


def _compare(saved: list, ours: list, path: str) -> None:
    for theirs, mine in zip(saved, ours):
        if theirs != mine:
            raise RuntimeError(
                f"LoadContext(): {path} was saved for another system. The first difference: the file has {theirs[1]} "
                f"{theirs[0]} with {theirs[2]}, here is {mine[1]} {mine[0]} with {mine[2]}."
            )
    if len(saved) != len(ours):
        raise RuntimeError(f"LoadContext(): {path} was saved for {len(saved) - 1} systems, here are {len(ours) - 1}.")


def _encode_all(store: Store, kind: str, default: Store, arrays: list) -> list:
    values, defaults = getattr(store, kind), getattr(default, kind)
    found: list = []
    for n in store.layout.leaves:
        for _ in getattr(store.systems[n], "_xa_models" if kind == "abstract" else "_pa_models"):
            where = f"value {len(found)} ({kind}) in {store.context(n).GetSystemPathname()},"
            found.append(_encode(_bare(values[len(found)]), arrays, where, _bare(defaults[len(found)])))
    return found


def _bare(value: Any) -> Any:
    return value.get_value() if isinstance(value, AbstractValue) else value


def _is_same(value: Any, other: Any) -> bool:
    """Whether two values are of one type and equal; settings, field by field."""
    if type(value) is not type(other):
        return False
    fields = getattr(value, "__fields__", None)
    if fields:
        return all(_is_same(getattr(value, f.name), getattr(other, f.name)) for f in fields)
    return bool(np.array_equal(value, other)) if isinstance(value, np.ndarray) else bool(value == other)


def _encode(value: Any, arrays: list, where: str, default: Any = None) -> Any:
    """JSON for a value, or `_AS_DEFAULT` for one of a type that has no JSON but is as in the default context."""
    try:
        return {"plain_of": _json(value.ToPlain(), arrays)} if hasattr(value, "ToPlain") else _json(value, arrays)
    except TypeError:
        if default is not None and _is_same(value, default):
            return _AS_DEFAULT
        raise TypeError(
            f"SaveContext(): {where} is a {type(value).__name__} that changed, which cannot be saved; numbers, "
            "strings, arrays, lists and dicts of these, and objects with ToPlain() and SetFromPlain() can."
        ) from None


def _json(value: Any, arrays: list) -> Any:
    if isinstance(value, np.ndarray) and value.dtype != object:
        arrays.append(value)
        return {"array": len(arrays) - 1}
    if type(value) in _PLAIN:
        return {"plain": value}
    if type(value) in (list, tuple):
        return {type(value).__name__: [_json(v, arrays) for v in value]}
    if type(value) is dict and all(type(k) is str for k in value):
        return {"dict": {k: _json(v, arrays) for k, v in value.items()}}
    raise TypeError(type(value).__name__)


def _decode(text: Any, arrays: list) -> Any:
    ((kind, content),) = text.items()
    if kind == "array":
        return arrays[content]
    if kind in ("list", "tuple"):
        return (list if kind == "list" else tuple)(_decode(v, arrays) for v in content)
    return {k: _decode(v, arrays) for k, v in content.items()} if kind == "dict" else content
