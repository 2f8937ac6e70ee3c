"""Which degrees of freedom of a plant are meant."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from typing import TYPE_CHECKING

import numpy as np

from sheldrake.common._checked import checked
from sheldrake.common._kinds import anything, count, instance_of
from sheldrake.common._overloads import overload, overloaded

if TYPE_CHECKING:
    from sheldrake.multibody.plant import MultibodyPlant
    from sheldrake.multibody.tree._index import ModelInstanceIndex


@checked
class DofMask:
    """For each position of a plant, whether it is selected.

    Made as `()`, `(size, value)` with all selected or none, or `(values)`.

    Raises:
        RuntimeError: sizes differ, or velocities of a plant are not the derivatives of its positions.
    """

    @overloaded(
        overload(lambda self: self.__init__([])),
        overload(lambda self, size, value: self.__init__([value] * size), size=count, value=anything),
        overload(values=instance_of(Iterable)),
    )
    def __init__(self, values: Iterable):
        self._selected = tuple(bool(v) for v in values)

    @staticmethod
    def MakeFromModel(
        plant: MultibodyPlant, model_index: ModelInstanceIndex | str | None = None, *, model_name: str | None = None
    ) -> DofMask:
        """Returns a mask that selects the positions of a model instance, given by index or by name.

        Raises:
            RuntimeError: the plant is not finalized, or its velocities are not the derivatives of its positions.
        """
        model = model_name if model_index is None else model_index
        _check_plant("MakeFromModel", plant)
        instance = plant.GetModelInstanceByName(model) if isinstance(model, str) else model
        selected = np.zeros(plant.num_positions(), dtype=bool)
        for index in plant.GetJointIndices(instance):
            joint = plant.get_joint(index)
            selected[joint.position_start() : joint.position_start() + joint.num_positions()] = True
        return DofMask(list(selected))

    def size(self) -> int:
        """Returns how many positions there are."""
        return len(self._selected)

    def count(self) -> int:
        """Returns how many positions are selected."""
        return sum(self._selected)

    def __len__(self) -> int:
        return len(self._selected)

    def __iter__(self) -> Iterator[bool]:
        return iter(self._selected)

    def __getitem__(self, index: int) -> bool:
        if not 0 <= index < len(self._selected):
            raise IndexError(f"DofMask: index {index} is out of range; the size is {len(self._selected)}.")
        return self._selected[index]

    def __eq__(self, other: object) -> bool:
        return isinstance(other, DofMask) and self._selected == other._selected

    __hash__ = None  # type: ignore[assignment]

    def Complement(self) -> DofMask:
        """Returns a mask of what is not selected."""
        return DofMask([not v for v in self._selected])

    def _with(self, call: str, other: DofMask, combine: Callable[[bool, bool], bool]) -> DofMask:
        if self.size() != other.size():
            raise RuntimeError(f"DofMask.{call}(): the masks have sizes {self.size()} and {other.size()}.")
        return DofMask([combine(a, b) for a, b in zip(self._selected, other._selected)])

    def Union(self, other: DofMask) -> DofMask:
        """Returns a mask of what either selects."""
        return self._with("Union", other, lambda a, b: a or b)

    def Intersect(self, other: DofMask) -> DofMask:
        """Returns a mask of what both select."""
        return self._with("Intersect", other, lambda a, b: a and b)

    def Subtract(self, other: DofMask) -> DofMask:
        """Returns a mask of what this one selects and the other does not."""
        return self._with("Subtract", other, lambda a, b: a and not b)

    def GetJoints(self, plant: MultibodyPlant) -> list:
        """Returns the indices of the joints with selected positions, in increasing order.

        Raises:
            RuntimeError: the plant has another number of positions.
        """
        _check_plant("GetJoints", plant)
        if plant.num_positions() != self.size():
            raise RuntimeError(
                f"DofMask.GetJoints(): the plant has {plant.num_positions()} positions, not {self.size()}."
            )
        out = []
        for index in plant.GetJointIndices():
            joint = plant.get_joint(index)
            start = joint.position_start()
            if any(self._selected[start : start + joint.num_positions()]):
                out.append(index)
        return out

    def GetSelectedToFullIndex(self) -> list[int]:
        """Returns for each selected position its place among all."""
        return [i for i, v in enumerate(self._selected) if v]

    def GetFullToSelectedIndex(self) -> list[int | None]:
        """Returns for each position its place among the selected ones, or None."""
        place = {full: i for i, full in enumerate(self.GetSelectedToFullIndex())}
        return [place.get(i) for i in range(self.size())]


def _check_plant(call: str, plant: MultibodyPlant) -> None:
    if not plant.is_finalized():
        raise RuntimeError(f"DofMask.{call}(): the plant is not finalized.")
    if not plant.IsVelocityEqualToQDot():
        raise RuntimeError(f"DofMask.{call}(): velocities of the plant are not the derivatives of its positions.")
