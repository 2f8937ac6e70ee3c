"""What state and parameters are when nobody has set them."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from sheldrake.systems.framework._engine.store import Store
from sheldrake.systems.framework._vector import lifted

if TYPE_CHECKING:
    from sheldrake.systems.framework._engine.memory import Place
    from sheldrake.systems.framework._leaf_system import LeafSystem


def set_defaults(store: Store, n: int) -> None:
    """Default state and parameters of all leaves under node `n`."""
    set_declared(store, n)
    layout = store.layout
    leaves = set(layout.leaves[layout.nodes[n].first_leaf : layout.nodes[n].last_leaf])
    own = [m for m in layout.with_own_defaults if m in leaves]
    for m in own:
        store.systems[m]._set_default_context(store.context(m))
    if own:
        store.out_of_date()
    if layout.structures:
        store.restructure()


def set_declared(store: Store, n: int) -> None:
    """State and parameters with which leaves under node `n` declared them."""
    layout = store.layout
    numbers, place = _default_numbers(store), layout.places[n]
    for a, b in (place.xc, place.xd, place.p):
        if b > a:
            store.S[a:b] = lifted(numbers[a:b], store.scalar) if numbers.dtype == float else numbers[a:b]
    leaves = set(layout.leaves[layout.nodes[n].first_leaf : layout.nodes[n].last_leaf])
    for m in layout.with_abstract:
        if m in leaves:
            _set_abstract_defaults(store, store.systems[m], layout.places[m])
    store.out_of_date()


def _set_abstract_defaults(store: Store, system: LeafSystem, place: Place) -> None:
    for k, model in enumerate(system._xa_models):
        store.abstract[place.abstract[0] + k].SetFrom(model)
    for k, model in enumerate(system._pa_models):
        store.parameters[place.abstract_parameters[0] + k].SetFrom(model)


_TIME = np.zeros(1)


def _default_numbers(store: Store) -> np.ndarray:
    """Time, state and parameters that all leaves declared; kept while nobody declares others."""
    layout = store.layout
    version = sum(s._defaults_version for s in store.systems)
    if layout.defaults is None or layout.defaults[0] != version:
        leaves = [store.systems[m] for m in layout.leaves]
        models = [system._xc_model for system in leaves]  # all one after the other, as `Memory` places them
        models += [model for system in leaves for model in system._xd_models]
        models += [model for system in leaves for model in system._pn_models]
        numbers = np.concatenate([_TIME, *[model._v for model in models]])
        layout.defaults = version, lifted(numbers, store.scalar)
    return layout.defaults[1]
