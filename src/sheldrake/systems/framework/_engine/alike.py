"""What layouts of roots that declare alike have in common: where everything is, and the tables of the event loop.

Programs make diagrams again and again that differ in numbers alone. Numbers of systems, their functions and their
arrays belong to each layout; all else follows from what is declared, and is kept by that.
"""

from __future__ import annotations

import operator
from collections.abc import Hashable, Sequence
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from sheldrake.common._native.binding import HERE, Words
from sheldrake.common.kernel import Kernel
from sheldrake.systems.framework._declarations import FedStage, PythonStage
from sheldrake.systems.framework._engine.scratch import LARGE, are_same, arrays_of, size_of

if TYPE_CHECKING:
    from sheldrake.systems.framework._engine.layout import Act, Row


class Family:
    """Layouts of roots that declare alike.

    Attributes:
        members: What layouts have in common, by what their systems chose: attributes by name.
    """

    def __init__(self) -> None:
        self.members: dict[Hashable, dict[str, Any]] = {}
        self._forms: dict[int, tuple[Any, Hashable]] = {}

    def keep(self, key: Hashable, attributes: dict[str, Any]) -> None:
        """Keeps what a layout has in common with others."""
        if len(self.members) < _MOST_MEMBERS:
            self.members[key] = attributes

    def chosen_by(self, acts: Sequence[Act], prototypes: dict[int, Any]) -> Hashable:
        """What systems chose for this root: stages of their events and derivatives, and the form of their scratch."""
        forms = tuple([p if isinstance(p, int) else self._form_of(n, p) for n, p in prototypes.items()])
        return forms, tuple([(n, repeats, *map(_stage, stages)) for n, _, stages, repeats in acts])

    def _form_of(self, n: int, prototype: Any) -> Hashable:
        known = self._forms.get(n)
        if known is not None and are_same(known[0], prototype):
            return known[1]
        form = type(prototype), *[a.shape for a in arrays_of(prototype)]
        if size_of(prototype) < LARGE:
            self._forms[n] = prototype, form
        return form


_families: dict[Hashable, Family] = {}
_MOST, _MOST_MEMBERS = 64, 16  # a program that makes other diagrams for ever must not fill memory


def family_of(systems: list[Any], overrides: frozenset[tuple[int, int]]) -> Family:
    """The layouts of roots that declare what this one does, whose systems are given."""
    key = overrides, *map(_declared_by, systems)
    family = _families.get(key)
    if family is None:
        if len(_families) >= _MOST:
            _families.pop(next(iter(_families)), None)  # another thread may have taken it out
        family = _families[key] = Family()
    return family


def _declared_by(system: Any) -> Hashable:
    """All that layouts read of a system but its numbers, functions and arrays."""
    inputs = tuple([(d.data_type, d.size, d.optional) for d in system._inputs])
    if system._subsystems() is not None:
        wires = tuple(system._wires.items()), tuple(system._exported_inputs.items())
        return len(system._subsystems()), inputs, *wires, tuple(system._exported_outputs)
    outputs = [(d.data_type, d.size, d.state, d.tickets, d.cached, _kind_of(d.calc)) for d in system._outputs]
    sizes = tuple([model.size() for model in system._xd_models]), tuple([model.size() for model in system._pn_models])
    tickets = tuple(system._tickets.items()), tuple([entry.tickets for entry in system._cache_entries])
    events = [(e.kind, e.trigger, e.offset, e.period, _kind_of(e.handler)) for e in system._all_events()]
    traits = system._may_ask(), system._has_witnesses(), system._structured, system._sets_own_defaults()
    counts = system._xc_counts, len(system._xa_models), len(system._pa_models)
    derivatives = _kind_of(system._derivatives_calc()) if sum(system._xc_counts) else None
    calcs = tuple(outputs), tuple(events), derivatives, system._ports_are_lookups
    return system._scalar, inputs, *calcs, *sizes, *tickets, *traits, *counts


def _kind_of(calc: Any) -> Any:
    """What layouts know of what computes something: which kernel it is, of others only their type."""
    return calc if calc is None or isinstance(calc, (Kernel, str)) else type(calc)


def _stage(stage: Any) -> Hashable:
    if isinstance(stage, PythonStage):
        return stage.fills, stage.needs
    if isinstance(stage, FedStage):
        slots = [(name, s.span, s.row, s.free, s.abstract_state, s.vector) for name, s in stage.reads.items()]
        return stage.kernel, tuple(slots), tuple(stage.models)
    return _kind_of(stage)


class _Template(NamedTuple):
    """Words of all rows, without the addresses of the arrays that they are given."""

    words: np.ndarray
    begins: list[int]
    at: np.ndarray
    of: np.ndarray
    """Which array each address is of."""
    shift: np.ndarray
    """0 where an address is in bytes, 3 where in doubles."""


class Templates:
    """The words of layouts that are alike, for models of the same shapes."""

    def __init__(self) -> None:
        self._known: dict[Hashable, _Template] = {}

    def placed(self, rows: list[Row], join: Any) -> tuple[np.ndarray, list[int]]:
        """The words of all rows for this process, and where those of each begin.

        Args:
            rows: They have the arrays.
            join: Gives `Words` with an address left out for each array, and where those of each row begin.
        """
        forms, arrays, places = _models_of(rows)
        known = self._known.get(forms)
        if known is None:
            words, begins = join()
            known = _template(words, begins, arrays)
            if len(self._known) < _MOST_MEMBERS:
                self._known[forms] = known
        words = known.words.copy()
        if len(known.at):
            words[known.at] = np.array(places, np.int64)[known.of] >> known.shift
        return words, known.begins


def _template(words: Words, begins: list[int], arrays: list[np.ndarray]) -> _Template:
    number = {id(a): k for k, a in enumerate(arrays)}
    at = [r.at for r in words.relocations]
    of = [number[id(r.array)] for r in words.relocations]
    shift = [0 if r.absolute else 3 for r in words.relocations]
    return _Template(words.words, begins, *(np.array(numbers, np.int64) for numbers in (at, of, shift)))


class _Seen(NamedTuple):
    """A model of a kernel, an array or a table, as layouts see it."""

    model: Any
    form: Hashable
    arrays: list[np.ndarray]
    places: list[int]
    """Addresses of the arrays [bytes]."""


_seen: dict[int, _Seen] = {}
_MOST_SEEN, _SMALL = 64, 1 << 14  # tables, bytes of one
_form_of = operator.attrgetter("dtype", "shape", "strides", "flags.aligned")
_is_writable, _bytes_of = operator.attrgetter("flags.writeable"), operator.attrgetter("nbytes")


def _look_at(model: Any) -> _Seen:
    """Looks at a model; read-only tables, which are many layouts', are known from the last time if they are small."""
    known = _seen.get(id(model))
    if known is None:
        parts = model if isinstance(model, (tuple, list)) else (model,)
        arrays = [part for part in parts if isinstance(part, np.ndarray)]
        form: list[Any] = [type(model), len(arrays), *map(_form_of, arrays)]
        if len(arrays) < len(parts):  # -0.0 is not 0.0
            form += [None if isinstance(x, np.ndarray) else x.hex() if isinstance(x, float) else x for x in parts]
        known = _Seen(model, tuple(form), arrays, HERE.places(arrays))
        shared = isinstance(model, tuple) and not any(map(_is_writable, arrays))
        if shared and sum(map(_bytes_of, arrays)) <= _SMALL:
            if len(_seen) >= _MOST_SEEN:
                _seen.pop(next(iter(_seen)), None)  # another thread may have taken it out
            _seen[id(model)] = known
    return known


def _models_of(rows: list[Row]) -> tuple[Hashable, list[np.ndarray], list[int]]:
    """The form of all models of rows, with which of them are the same object; their arrays, and where these are."""
    forms: list[Any] = []
    arrays: list[np.ndarray] = []
    places: list[int] = []
    number: dict[int, int] = {}  # of what was met
    for row in rows:
        if not row.models:
            continue
        forms.append(number.setdefault(id(row.models), len(number)))
        if forms[-1] < len(number) - 1:
            continue
        forms.append(tuple(row.models))
        for model in row.models.values():
            forms.append(number.setdefault(id(model), len(number)))
            if forms[-1] == len(number) - 1:
                seen = _look_at(model)
                forms.append(seen.form)
                arrays += seen.arrays
                places += seen.places
    if len({*map(id, arrays)}) < len(arrays):  # some lie in two models
        first: dict[int, int] = {}
        forms += [first.setdefault(id(a), k) for k, a in enumerate(arrays)]
    return tuple(forms), arrays, places
