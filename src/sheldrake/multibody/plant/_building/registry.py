"""Lists of elements with names that are unique per kind and model instance."""

from __future__ import annotations

import operator
from typing import Any, Generic, TypeVar

from sheldrake.multibody.tree._index import ModelInstanceIndex

E = TypeVar("E")


class Registry(Generic[E]):
    """Elements of one kind in order of registration; removed ones leave a hole, as their numbers are never reused."""

    def __init__(self, kind: str, words: str, index_type: type, instances: Registry | None = None):
        """
        Args:
            kind: Class name of the elements, for messages.
            words: The kind in plain words.
            index_type: Their typed index.
            instances: Model instances; None for the registry of these.
        """
        self.kind, self.words, self.index_type = kind, words, index_type
        self.slots: list[E | None] = []
        self._by_name: dict[str, list[E]] = {}
        self._taken: set[tuple[str, Any]] = set()  # names with their model instances
        self._instances = instances

    def __iter__(self) -> Any:
        return (e for e in self.slots if e is not None)

    def __len__(self) -> int:
        return sum(e is not None for e in self.slots)

    def add(self, element: E, name: str | None) -> int:
        """Appends an element; its number.

        Raises:
            RuntimeError: the name is taken in its model instance.
        """
        if name is not None:
            self.check_free(name, element.model_instance())  # type: ignore[attr-defined]
            self._by_name.setdefault(name, []).append(element)
            self._taken.add((name, element.model_instance()))  # type: ignore[attr-defined]
        self.slots.append(element)
        return len(self.slots) - 1

    def check_free(self, name: str, instance: Any) -> None:
        """Raises RuntimeError when a model instance has an element of this name."""
        if (name, instance) in self._taken:
            raise RuntimeError(
                f"Model instance '{self._instance_name(instance)}' already contains a {self.words} named '{name}'. "
                f"{self.words.capitalize()} names must be unique within a given model."
            )

    def remove(self, element: E, name: str) -> None:
        """Takes an element out; its number stays unused."""
        self.slots[int(element.index())] = None  # type: ignore[attr-defined]
        self._by_name[name].remove(element)
        self._taken.remove((name, element.model_instance()))  # type: ignore[attr-defined]

    def get(self, index: Any, call: str) -> E:
        """The element of this number.

        Raises:
            RuntimeError: there is none, or the number is of another kind.
        """
        if not hasattr(index, "__index__"):
            raise TypeError(f"{call}(): incompatible function arguments. Expected a {self.index_type.__name__}, "
                            f"not {index!r}.")  # fmt: skip
        i = operator.index(index)
        if not 0 <= i < len(self.slots) or self.slots[i] is None:
            raise RuntimeError(
                f"{call}(): The given {self.index_type.__name__}({i}) is out of bounds "
                f"(must be less than {len(self.slots)})"
                if not 0 <= i < len(self.slots)
                else f"{call}(): there is no {self.words} with {self.index_type.__name__}({i}); it was removed."
            )
        return self.slots[i]  # type: ignore[return-value]

    def has(self, index: Any) -> bool:
        """Whether there is an element of this number."""
        return 0 <= int(index) < len(self.slots) and self.slots[int(index)] is not None

    def find(self, name: str, instance: Any = None) -> list[E]:
        """All elements of a name, in one model instance or in all."""
        found = self._by_name.get(name, [])
        return [e for e in found if instance is None or e.model_instance() == instance]  # type: ignore[attr-defined]

    def of_instance(self, instance: Any) -> list[E]:
        """The elements of a model instance, in order."""
        return [e for e in self if e.model_instance() == instance]

    def by_name(self, call: str, name: str, instance: Any = None) -> E:
        """The one element of a name.

        Raises:
            RuntimeError: there is none or more than one; the message lists the valid names.
        """
        if not isinstance(name, str):
            raise TypeError(f"{call}(): incompatible function arguments. name must be a str, not {name!r}.")
        found = self.find(name, instance)
        if len(found) == 1:
            return found[0]
        if found:
            names = sorted(self._instance_name(e.model_instance()) for e in found)  # type: ignore[attr-defined]
            raise RuntimeError(
                f"{call}(): There is more than one {self.kind} named '{name}' in the model: it is in model instances "
                f"{', '.join(repr(n) for n in names)}. Pass the model instance too."
            )
        where = "anywhere in the model" if instance is None else f"in model instance '{self._instance_name(instance)}'"
        raise RuntimeError(f"{call}(): There is no {self.kind} named '{name}' {where} ({self._valid(name, instance)})")

    def _valid(self, name: str, instance: Any) -> str:
        names: dict[str, list[str]] = {}
        for e in self:
            names.setdefault(self._instance_name(e.model_instance()), []).append(e.name())
        if instance is not None:
            own = names.get(self._instance_name(instance), [])
            text = f"valid names in model instance '{self._instance_name(instance)}' are: {', '.join(sorted(own))}"
            elsewhere = [self._instance_name(e.model_instance()) for e in self.find(name)]  # type: ignore[attr-defined]
            return text + (f"; it is in model instance {elsewhere[0]!r}" if elsewhere else "")
        parts = [f"valid names in model instance '{i}' are: {', '.join(sorted(n))}" for i, n in names.items()]
        return "; ".join(parts) or "there are none at all"

    def _instance_name(self, instance: Any) -> str:
        assert self._instances is not None
        return self._instances.get(instance, "model_instance").name()


class ModelInstance:
    """A named group of elements."""

    def __init__(self, name: str):
        self._name = name

    def name(self) -> str:
        """Its name."""
        return self._name


class ModelInstances(Registry[ModelInstance]):
    """Model instances by number and name."""

    def __init__(self) -> None:
        super().__init__("model instance", "model instance", ModelInstanceIndex)

    def add_named(self, name: str) -> ModelInstanceIndex:
        """A new model instance.

        Raises:
            RuntimeError: the name is taken.
        """
        if not isinstance(name, str):
            raise TypeError(f"AddModelInstance(): incompatible function arguments. name must be a str, not {name!r}.")
        if any(m.name() == name for m in self):
            raise RuntimeError(
                f"This model already contains a model instance named '{name}'. Model instance names must be unique "
                "within a given model."
            )
        self.slots.append(ModelInstance(name))
        return ModelInstanceIndex(len(self.slots) - 1)

    def index_of(self, call: str, name: str) -> ModelInstanceIndex:
        """The number of a name.

        Raises:
            RuntimeError: there is none; the message lists the valid names.
        """
        for i, m in enumerate(self.slots):
            if m is not None and m.name() == name:
                return ModelInstanceIndex(i)
        names = ", ".join(sorted(f"'{m.name()}'" for m in self))
        raise RuntimeError(
            f"{call}(): There is no model instance named '{name}'. The current model instances are {names}."
        )
