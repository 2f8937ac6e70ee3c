"""What is registered in a plant and its scene graph, kept to go back to when something fails half way."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any

from sheldrake.multibody.plant._building.registry import Numbered
from sheldrake.multibody.plant._parts import parts_of

if TYPE_CHECKING:
    from sheldrake.multibody.plant._multibody_plant import MultibodyPlant


@contextmanager
def all_or_nothing(plant: MultibodyPlant, *others: object) -> Iterator[None]:
    """When the block raises, the plant before Finalize(), its geometry, and `others` are as they were.

    What the block changes of elements that were there before is not undone. Model numbers are used again.

    Args:
        plant: A `MultibodyPlant`.
        others: Objects whose dictionaries, lists and sets are put back too.
    """
    parts = parts_of(plant)
    scene_graph = parts.geometry.scene_graph
    geometry = None if scene_graph is None else scene_graph._model.copy()
    saved = [
        (container, _copy(container))
        for owner in (parts.elements, parts.geometry, parts.free_bodies, *others)
        for container in _containers(owner)
    ]
    gravity = set(parts.elements.gravity._disabled)
    try:
        yield
    except BaseException:
        for container, content in saved:
            _put_back(container, content)
        parts.elements.gravity._disabled = gravity
        if scene_graph is not None and geometry is not None:
            scene_graph._model = geometry
        raise


def _containers(owner: object) -> list[Any]:
    """The lists, dictionaries and sets that an object and its registries consist of."""
    found: list[Any] = []
    for value in vars(owner).values():
        if type(value) in _CONTAINERS:
            found.append(value)
        elif isinstance(value, Numbered):
            found += _containers(value)
    return found


_CONTAINERS = {dict, list, set}


def _copy(container: Any) -> Any:
    if type(container) is dict:
        return {key: v.copy() if type(v) in _CONTAINERS else v for key, v in container.items()}
    return container.copy()


def _put_back(container: Any, content: Any) -> None:
    container.clear()
    if isinstance(container, list):
        container.extend(content)
    else:
        container.update(content)
