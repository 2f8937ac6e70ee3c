"""Names with their model instance: `model::name`."""

from __future__ import annotations

from sheldrake.common._checked import checked

_SEPARATOR = "::"


class ScopedName:
    """A name in two parts: the namespace (a model instance, possibly nested) and the element in it."""

    def __init__(self, namespace_name: str | None = None, element_name: str | None = None):
        if (namespace_name is None) != (element_name is None):
            raise TypeError(
                "ScopedName(): incompatible constructor arguments. Give both namespace_name and element_name, or none."
            )
        if namespace_name is not None and element_name is not None:
            made = self.Make(namespace_name, element_name)
            if made is None:
                raise RuntimeError(
                    f"ScopedName(): namespace {namespace_name!r} and element {element_name!r} do not make a scoped "
                    "name: the element must not be empty or contain '::', the namespace not start or end with '::'."
                )
            self._namespace, self._element = namespace_name, element_name
        else:
            self._namespace = self._element = ""

    @staticmethod
    @checked
    def Make(namespace_name: str, element_name: str) -> ScopedName | None:
        """The scoped name, or None when the parts do not make one."""
        if not element_name or _SEPARATOR in element_name:
            return None
        if namespace_name.startswith(_SEPARATOR) or namespace_name.endswith(_SEPARATOR):
            return None
        new = ScopedName()
        new._namespace, new._element = namespace_name, element_name
        return new

    @staticmethod
    @checked
    def Join(name1: str, name2: str) -> ScopedName:
        """`name1::name2`, whichever of the two is scoped itself."""
        return ScopedName.Parse(f"{name1}{_SEPARATOR}{name2}")

    @staticmethod
    @checked
    def Parse(scoped_name: str) -> ScopedName:
        """Splits at the last '::'; those at the ends of either part are ignored."""
        new = ScopedName()
        namespace, _, new._element = _without_separators(scoped_name).rpartition(_SEPARATOR)
        new._namespace = _without_separators(namespace)
        return new

    def get_namespace(self) -> str:
        """The model instance, "" for none."""
        return self._namespace

    def get_element(self) -> str:
        """The element's own name."""
        return self._element

    def get_full(self) -> str:
        """Both, joined by '::'."""
        return f"{self._namespace}{_SEPARATOR}{self._element}" if self._namespace else self._element

    def to_string(self) -> str:
        """The same as `get_full`."""
        return self.get_full()

    @checked
    def set_namespace(self, namespace_name: str) -> None:
        """Changes the namespace.

        Raises:
            RuntimeError: it starts or ends with '::'.
        """
        if namespace_name.startswith(_SEPARATOR) or namespace_name.endswith(_SEPARATOR):
            raise RuntimeError(f"ScopedName.set_namespace(): {namespace_name!r} starts or ends with '::'.")
        self._namespace = namespace_name

    @checked
    def set_element(self, element_name: str) -> None:
        """Changes the element's name.

        Raises:
            RuntimeError: it is empty or contains '::'.
        """
        if not element_name or _SEPARATOR in element_name:
            raise RuntimeError(f"ScopedName.set_element(): {element_name!r} is empty or contains '::'.")
        self._element = element_name

    def __eq__(self, other: object) -> bool:
        return isinstance(other, ScopedName) and self.get_full() == other.get_full()

    def __hash__(self) -> int:
        return hash(self.get_full())

    def __str__(self) -> str:
        return self.get_full()

    def __repr__(self) -> str:
        return f"ScopedName({self._namespace!r}, {self._element!r})"


def _without_separators(name: str) -> str:
    """A name without '::' at its ends."""
    while name.startswith(_SEPARATOR):
        name = name.removeprefix(_SEPARATOR)
    while name.endswith(_SEPARATOR):
        name = name.removesuffix(_SEPARATOR)
    return name
