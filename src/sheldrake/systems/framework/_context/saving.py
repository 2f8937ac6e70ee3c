"""Contexts in files: what one process saves, another loads and goes on with, bit by bit as if it had never stopped."""

from __future__ import annotations

import json
import os
import re
import zipfile
from collections.abc import Iterator
from typing import TYPE_CHECKING, Any

import numpy as np

from sheldrake.common._files import whole_file
from sheldrake.common.value import AbstractValue
from sheldrake.systems.framework._engine.scratch import views_of
from sheldrake.systems.framework._engine.store import CONTINUOUS, Store
from sheldrake.systems.framework._engine.topology import tree_of
from sheldrake.systems.framework._kernels.program import Log

if TYPE_CHECKING:
    from sheldrake.systems.framework._context.context import Context
    from sheldrake.systems.framework._system import System

FORMAT = 1
_PLAIN = (bool, int, float, str, type(None))
_PARTS = {"S": np.float64, "I": np.int64, "L": np.float64}
_AS_DEFAULT = {"as": "default"}
_MANY = 1 << 53
_FAULTS = (LookupError, ValueError, TypeError, AttributeError, OverflowError, RecursionError)
_MADE_UP = re.compile(r"@[0-9a-f]{16}(?=::|$)")


def SaveContext(context: Context, path: str | os.PathLike) -> None:
    """Writes a root context (time, state, parameters, fixed inputs, logs) to a NumPy archive (.npz).

    Numbers are kept to the last bit. Abstract values may be numbers, strings, arrays, lists and dicts of these, and
    objects with methods `ToPlain()` (their content as such values) and `SetFromPlain(content)`; one of another type
    must still be as in the default context. Nothing in the file is code.

    A simulator of a loaded context goes on from where the saved run stopped: it does not initialize by itself, and an
    integrator of the same kind takes up its step size and matrices.

    Args:
        context: A root context of floats.
        path: The file. It is there whole or as it was before, also when the disk is full or the process is killed.

    Raises:
        OSError: the file cannot be written.
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
    if store.unsettled:  # called while something is computed: a copy has what waits
        stopped, store = store.stopped, store.clone()
        store.settle()
        store.stopped = stopped
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
    with whole_file(path) as file:
        np.savez(file, allow_pickle=False, meta=np.array(text), **slab)


def LoadContext(system: System, path: str | os.PathLike) -> Context:
    """A context for `system` with what `SaveContext` wrote for a system built the same way.

    Args:
        system: The root system.
        path: The file.

    The file need not be trusted: all of it is checked against the system before a number is used. Systems without a
    name of their own are told apart by their place.

    Raises:
        RuntimeError: the file is not one of SaveContext's, or was written for another system; the first difference is
            named.
    """
    meta, found = _read(os.fspath(path))
    try:
        return _load(system, os.fspath(path), meta, found)
    except _FAULTS as error:
        raise RuntimeError(f"LoadContext(): {path} is no file of SaveContext(): {error}.") from error


def _load(system: System, path: str, meta: dict, found: dict) -> Context:
    systems = tree_of(system)
    overrides = frozenset((_whole(n, len(systems)), int(i)) for n, i in meta["overrides"])
    for n, i in overrides:
        _whole(i, len(systems[n]._inputs))
    context = system.CreateDefaultContext()
    if overrides:
        context = Store(system._layout_with(overrides), systems, float).context(0)
        system.SetDefaultContext(context)
    store: Store = context._store
    _compare(meta["structure"], _structure(store), path)
    arrays = [found[f"array{k}"] for k in range(len(found) - len(_PARTS))]
    _take_numbers(store, found)
    store.accuracy = None if meta["accuracy"] is None else _number(meta["accuracy"], "accuracy")
    for values, saved in ((store.abstract, meta["abstract"]), (store.parameters, meta["parameters"])):
        _expect(len(saved) == len(values), f"it has {len(saved)} abstract values where the system has {len(values)}")
        for value, text in zip(values, saved):
            _set(value, text, arrays)
    _take_fixed(store, meta["fixed"], arrays)
    store.out_of_date()
    store.settle()
    if meta["stopped"] is not None:
        t, integrator, memory = meta["stopped"]
        _expect(type(integrator) is str and type(memory) is list, "it does not say how its run stopped")
        store.goes_on = _number(t, "time"), integrator, memory
    return context


def _take_numbers(store: Store, found: dict) -> None:
    """Slab, side and logs, as far as they are sound: what kernels take for an index is in its range."""
    layout, S, I, L = store.layout, found["S"], found["I"], found["L"]
    _expect(S.shape == store.S.shape and I.shape == store.I.shape, "its arrays have other sizes")
    _number(float(S[0]), "time")
    counters, logs = I[: CONTINUOUS + 1], I[layout.log0 : layout.fixed0].reshape(-1, 3)
    _expect(np.all((counters >= 1) & (counters < _MANY)), "its counters of changes are none")
    _expect(np.all((I[layout.k0 : layout.trig0] >= 0) & (I[layout.k0 : layout.trig0] < _MANY)), "its clocks are none")
    flags = np.r_[I[layout.trig0 : layout.log0], I[layout.fixed0 :]]
    _expect(np.all((flags == 0) | (flags == 1)), "its flags are neither 0 nor 1")
    start, room, count = logs.T
    size = layout.program.log[:, Log.length] + 1
    _expect(np.all((room >= 0) & (room <= len(L)) & (count >= 0) & (count <= room)), "its logs have no such room")
    ends = np.cumsum(room * size)
    _expect(np.array_equal(start, ends - room * size) and ends[-1:].sum() == len(L), "its logs are not one by one")
    sound = {n: _scratch_fault(store, n, S) for n in layout.leaves}
    for n, fault in sound.items():
        _expect(not fault, f"the scratch of {store.context(n).GetSystemPathname()} has {fault}")
    integers = [(a, a.copy()) for n in layout.leaves for a in _own_integers(store, n)]
    store.S[:], store.I[:], store.L = S, I, L.copy()
    store.forget_readers()  # which inputs are fixed may be others
    for array, initial in integers:
        array[...] = initial
    store.I[layout.stamp0 : layout.k0] = 0  # computed values are computed anew
    store.I[CONTINUOUS + 1 : layout.stamp0] = 0


def _own_integers(store: Store, n: int) -> Iterator[np.ndarray]:
    """Integers in a leaf's scratch that mean nothing once a step is over: they stay as in a new context."""
    if isinstance(store.layout.prototypes[n], int):
        return
    kept = store.systems[n]._integers_kept
    scratch: Any = store.scratch(n)
    for name, field in zip(scratch._fields, scratch):
        parts = field if isinstance(field, tuple) else (field,)
        for part, array in zip(getattr(field, "_fields", ("",)), parts):
            if array.dtype == np.int64 and f"{name}.{part}" not in kept:
                yield array


def _scratch_fault(store: Store, n: int, S: np.ndarray) -> str:
    """What is wrong with a leaf's scratch in a slab of a file, or ""."""
    prototype = store.layout.prototypes[n]
    if isinstance(prototype, int):
        return ""
    scratch = views_of(S, store.layout.places[n].work[0], prototype)
    return store.systems[n]._scratch_fault(scratch)


def _take_fixed(store: Store, saved: dict, arrays: list) -> None:
    """Abstract values of fixed inputs: of every port that is fixed, and of no other."""
    layout = store.layout
    for port, k in layout.free.items():
        slot = layout.free_slots[k]
        is_fixed = bool(store.I[layout.fixed0 + k])
        _expect(not is_fixed or slot.vector or str(k) in saved, f"fixed input {k} has no value")
        if str(k) in saved:
            _expect(is_fixed and not slot.vector, f"input {k} is not fixed to an abstract value")
            store.fixed[k] = value = store.systems[port[0]]._inputs[port[1]].model.Clone()
            _set(value, saved[str(k)], arrays)
    _expect(len(store.fixed) == len(saved), "it fixes inputs that the system does not have")


def _set(value: AbstractValue, text: dict, arrays: list) -> None:
    if "plain_of" in text:
        value.get_mutable_value().SetFromPlain(_decode(text["plain_of"], arrays))
    elif text != _AS_DEFAULT:
        kind = type(value.get_value())
        _expect(not hasattr(kind, "SetFromPlain"), f"it has a plain value where the system has a {kind.__name__}")
        value.set_value(_decode(text, arrays))


def _expect(is_so: object, otherwise: str) -> None:
    if not is_so:
        raise ValueError(otherwise)


def _whole(number: Any, end: int) -> int:
    _expect(type(number) is int and 0 <= number < end, f"{number!r} is no number below {end}")
    return number


def _number(number: Any, what: str) -> float:
    _expect(type(number) in (int, float) and np.isfinite(number), f"{number!r} is no {what}")
    return number


def _read(path: str) -> tuple[dict, dict]:
    try:
        with zipfile.ZipFile(path) as packed:
            if any(part.compress_type != zipfile.ZIP_STORED for part in packed.infolist()):
                raise ValueError("its parts are compressed")  # none of ours is; a small file could fill all memory
        with np.load(path, allow_pickle=False) as archive:
            found = {name: archive[name] for name in archive.files}
        meta = json.loads(str(found.pop("meta")))
        if type(meta) is not dict or type(meta["overrides"]) is not list or type(meta["fixed"]) is not dict:
            raise ValueError("its description is none")
        if meta["format"] != FORMAT:
            raise ValueError(f"its format is {meta['format']}, not {FORMAT}")
        if not all(found[name].dtype == kind and found[name].ndim == 1 for name, kind in _PARTS.items()):
            raise ValueError("its arrays have other types")
    except FileNotFoundError:
        raise
    except Exception as error:  # what NumPy raises for a damaged header, of Python's own parser, is not listed anywhere
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
        entries.append([_plain_name(store.context(n).GetSystemPathname()), type(system).__name__, numbers])
    return [*entries, ["memory", "numbers", {"slab": layout.size, "side": layout.side_size}]]


def _plain_name(path: str | os.PathLike) -> str:
    """A path without the counter in names that nobody gave: the same system built again has others."""
    return _MADE_UP.sub("@", str(path))


def _compare(saved: list, ours: list, path: str) -> None:
    if not isinstance(saved, list) or not all(isinstance(entry, list) and len(entry) == 3 for entry in saved):
        raise ValueError("it does not say which systems it was saved for")
    saved = [[_plain_name(entry[0]), *entry[1:]] for entry in saved]
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


def _bare(value: object) -> Any:
    return value.get_value() if isinstance(value, AbstractValue) else value


def _is_same(value: Any, other: Any) -> bool:
    """Whether two values are of one type and equal; settings, field by field."""
    if type(value) is not type(other):
        return False
    fields = getattr(value, "__fields__", None)
    if fields:
        return all(_is_same(getattr(value, f.name), getattr(other, f.name)) for f in fields)
    return bool(np.array_equal(value, other)) if isinstance(value, np.ndarray) else bool(value == other)


def _encode(value: object, arrays: list, where: str, default: object = None) -> Any:
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


def _decode(text: dict[str, Any], arrays: list) -> Any:
    ((kind, content),) = text.items()
    if kind == "array":
        return arrays[content]
    if kind in ("list", "tuple"):
        return (list if kind == "list" else tuple)(_decode(v, arrays) for v in content)
    return {k: _decode(v, arrays) for k, v in content.items()} if kind == "dict" else content
