"""Lists of elements with names that are unique per kind and model instance."""

from __future__ import annotations

import operator
from collections.abc import Iterator
from typing import Any, Generic, SupportsIndex, TypeVar

from sheldrake.common._overloads import Mismatch
from sheldrake.multibody.tree._element import NamedElement
from sheldrake.multibody.tree._index import ModelInstanceIndex

Item = TypeVar("Item")
Named = TypeVar("Named", bound=NamedElement)


class Numbered(Generic[Item]):
    """Things of one kind in order of registration; removed ones leave a hole, as their numbers are never reused."""

    def __init__(self, words: str, index_type: type) -> None:
        """
        Args:
            words: The kind in plain words, for messages.
            index_type: Their typed index.
        """
        self.words, self.index_type = words, index_type
        self.slots: list[Item | None] = []
        self._num_removed = 0

    def __iter__(self) -> Iterator[Item]:
        if not self._num_removed:
            return iter(self.slots)  # type: ignore[arg-type]
        return (e for e in self.slots if e is not None)

    def __len__(self) -> int:
        return len(self.slots) - self._num_removed

    def append(self, item: Item) -> int:
        """Appends one; its number."""
        self.slots.append(item)
        return len(self.slots) - 1

    def get(self, index: SupportsIndex, call: str) -> Item:
        """The element of this number.

        Raises:
            RuntimeError: there is none, or the number is of another kind.
        """
        if not hasattr(index, "__index__"):
            raise Mismatch(f"{call}(): incompatible function arguments. Expected a {self.index_type.__name__}, "
                            f"not {index!r}.")  # fmt: skip
        i = operator.index(index)
        found = self.slots[i] if 0 <= i < len(self.slots) else None
        if found is None:
            raise RuntimeError(
                f"{call}(): The given {self.index_type.__name__}({i}) is out of bounds "
                f"(must be less than {len(self.slots)})"
                if not 0 <= i < len(self.slots)
                else f"{call}(): there is no {self.words} with {self.index_type.__name__}({i}); it was removed."
            )
        return found

    def has(self, index: SupportsIndex) -> bool:
        """Whether there is an element of this number."""
        return 0 <= int(index) < len(self.slots) and self.slots[int(index)] is not None


class Registry(Numbered[Named]):
    """Elements of one kind, whose names are unique in their model instance."""

    def __init__(self, kind: str, words: str, index_type: type, instances: ModelInstances) -> None:
        """
        Args:
            kind: Class name of the elements, for messages.
            words: The kind in plain words, for messages.
            index_type: Their typed index.
            instances: Model instances.
        """
        super().__init__(words, index_type)
        self.kind = kind
        self._by_name: dict[str, list[Named]] = {}
        self._taken: set[tuple[str, Any]] = set()  # names with their model instances
        self._instances = instances

    def add(self, element: Named) -> int:
        """Appends an element whose name is free; its number."""
        name = element._name
        self._by_name.setdefault(name, []).append(element)
        self._taken.add((name, element._instance))
        return self.append(element)

    def check_free(self, name: str, instance: ModelInstanceIndex) -> None:
        """Raises RuntimeError when a model instance has an element of this name."""
        if (name, instance) in self._taken:
            raise RuntimeError(
                f"Model instance '{self._instance_name(instance)}' already contains a {self.words} named '{name}'. "
                f"{self.words.capitalize()} names must be unique within a given model."
            )

    def remove(self, element: Named) -> None:
        """Takes an element out; its number stays unused."""
        name = element.name()
        self.slots[int(element.index())] = None
        self._num_removed += 1
        self._by_name[name].remove(element)
        self._taken.remove((name, element.model_instance()))

    def find(self, name: str, instance: ModelInstanceIndex | None = None) -> list[Named]:
        """All elements of a name, in one model instance or in all."""
        found = self._by_name.get(name, [])
        return list(found) if instance is None else [e for e in found if e._instance == instance]

    def of_instance(self, instance: ModelInstanceIndex) -> list[Named]:
        """The elements of a model instance, in order."""
        return [e for e in self.slots if e is not None and e._instance == instance]

    def indices(self, call: str, instance: ModelInstanceIndex | None = None) -> list[Any]:
        """Numbers of all elements, or of those of a model instance.

        Raises:
            RuntimeError: there is no such model instance.
        """
        if instance is None:
            return [e.index() for e in self]
        self._instances.get(instance, call)
        return [e.index() for e in self.of_instance(instance)]

    def has_named(self, call: str, name: str, instance: ModelInstanceIndex | None = None) -> bool:
        """Whether there is an element of this name, in one model instance or in all.

        Raises:
            RuntimeError: there is no such model instance, or none is given and more than one has the name.
        """
        found = self.find(name, instance)
        if instance is not None:
            self._instances.get(instance, call)
        elif len(found) > 1:
            self.by_name(call, name)
        return bool(found)

    def by_name(self, call: str, name: str, instance: ModelInstanceIndex | None = None) -> Named:
        """The one element of a name.

        Raises:
            RuntimeError: there is none or more than one; the message lists the valid names.
        """
        if not isinstance(name, str):
            raise Mismatch(f"{call}(): incompatible function arguments. name must be a str, not {name!r}.")
        found = self.find(name, instance)
        if len(found) == 1:
            return found[0]
        if found:
            names = sorted(self._instance_name(e.model_instance()) for e in found)
            raise RuntimeError(
                f"{call}(): There is more than one {self.kind} named '{name}' in the model: it is in model instances "
                f"{', '.join(repr(n) for n in names)}. Pass the model instance too."
            )
        where = "anywhere in the model" if instance is None else f"in model instance '{self._instance_name(instance)}'"
        raise RuntimeError(f"{call}(): There is no {self.kind} named '{name}' {where} ({self._valid(name, instance)})")

    def _valid(self, name: str, instance: ModelInstanceIndex | None) -> str:
        names: dict[str, list[str]] = {}
        for e in self:
            names.setdefault(self._instance_name(e.model_instance()), []).append(e.name())
        if instance is not None:
            own = names.get(self._instance_name(instance), [])
            text = f"valid names in model instance '{self._instance_name(instance)}' are: {', '.join(sorted(own))}"
            elsewhere = [self._instance_name(e.model_instance()) for e in self.find(name)]
            return text + (f"; it is in model instance {elsewhere[0]!r}" if elsewhere else "")
        parts = [f"valid names in model instance '{i}' are: {', '.join(sorted(n))}" for i, n in names.items()]
        return "; ".join(parts) or "there are none at all"

    def _instance_name(self, instance: ModelInstanceIndex) -> str:
        return self._instances.get(instance, "model_instance").name()


class ModelInstance:
    """A named group of elements."""

    def __init__(self, name: str):
        self._name = name

    def name(self) -> str:
        """Its name."""
        return self._name


class ModelInstances(Numbered[ModelInstance]):
    """Model instances by number and name."""

    def __init__(self) -> None:
        super().__init__("model instance", ModelInstanceIndex)
        self._by_name: dict[str, int] = {}

    def add_named(self, name: str) -> ModelInstanceIndex:
        """A new model instance.

        Raises:
            RuntimeError: the name is taken.
        """
        if not isinstance(name, str):
            raise Mismatch(f"AddModelInstance(): incompatible function arguments. name must be a str, not {name!r}.")
        _require_name("AddModelInstance", name)
        if self.has_name(name):
            raise RuntimeError(
                f"This model already contains a model instance named '{name}'. Model instance names must be unique "
                "within a given model."
            )
        self._by_name[name] = number = self.append(ModelInstance(name))
        return ModelInstanceIndex(number)

    def has_name(self, name: str) -> bool:
        """Whether there is a model instance of this name."""
        return name in self._by_name

    def rename(self, call: str, index: ModelInstanceIndex, name: str) -> None:
        """Gives a model instance another name.

        Raises:
            RuntimeError: another has it.
        """
        instance = self.get(index, call)
        _require_name(call, name)
        if name == instance.name():
            return
        if self.has_name(name):
            raise RuntimeError(
                f"{call}(): cannot rename model instance '{instance.name()}': there is already a model instance named "
                f"'{name}'."
            )
        self._by_name[name] = self._by_name.pop(instance.name())
        instance._name = name

    def index_of(self, call: str, name: str) -> ModelInstanceIndex:
        """The number of a name.

        Raises:
            RuntimeError: there is none; the message lists the valid names.
        """
        if isinstance(name, str) and name in self._by_name:
            return ModelInstanceIndex(self._by_name[name])
        names = ", ".join(sorted(f"'{m.name()}'" for m in self))
        raise RuntimeError(
            f"{call}(): There is no model instance named '{name}'. The current model instances are {names}."
        )


def _require_name(call: str, name: str) -> None:
    if not name:
        raise RuntimeError(f"{call}(): a model instance must have a name, not {name!r}.")
