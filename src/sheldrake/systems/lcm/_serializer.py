"""How messages become bytes and bytes messages."""

from __future__ import annotations

from typing import Any

from sheldrake.common.value import AbstractValue


class SerializerInterface:
    """What systems ask to write and read messages; derived classes override all three methods."""

    def CreateDefaultValue(self) -> AbstractValue:
        """A message to begin with."""
        raise NotImplementedError(f"{type(self).__name__} must override CreateDefaultValue().")

    def Deserialize(self, message_bytes: bytes, abstract_value: AbstractValue) -> None:
        """Puts the message that these bytes are into a value."""
        raise NotImplementedError(f"{type(self).__name__} must override Deserialize().")

    def Serialize(self, abstract_value: AbstractValue) -> bytes:
        """The bytes of a message."""
        raise NotImplementedError(f"{type(self).__name__} must override Serialize().")


class PySerializer(SerializerInterface):
    """For message classes with `encode()` and `decode(bytes)`, as lcm-gen makes them.

    Args:
        lcm_type: The class; it can be called without arguments.
    """

    def __init__(self, lcm_type: Any):
        super().__init__()
        for name in ("encode", "decode"):
            if not callable(getattr(lcm_type, name, None)):
                raise TypeError(f"PySerializer(): {lcm_type!r} has no {name}(); a message class has encode and decode.")
        self._lcm_type = lcm_type

    def __repr__(self) -> str:
        return f"PySerializer({self._lcm_type.__name__})"

    def CreateDefaultValue(self) -> AbstractValue:
        """A new message."""
        return AbstractValue.Make(self._lcm_type())

    def Deserialize(self, buffer: bytes, abstract_value: AbstractValue) -> None:  # type: ignore[override]
        abstract_value.set_value(self._lcm_type.decode(buffer))

    def Serialize(self, abstract_value: AbstractValue) -> bytes:
        message = abstract_value.get_value()
        if not isinstance(message, self._lcm_type) and not self._is_alike(message):
            raise TypeError(f"PySerializer.Serialize(): {message!r} is no {self._lcm_type.__name__}.")
        return message.encode()

    def _is_alike(self, message: Any) -> bool:
        """Whether a message of another class is encoded as one of ours: LCM names types by their first eight bytes."""
        encode = getattr(type(message), "encode", None)
        return callable(encode) and type(message)().encode()[:8] == self._lcm_type().encode()[:8]
