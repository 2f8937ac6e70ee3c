"""Enumerations as pydrake has them."""

import enum


class IndexEnum(enum.Enum):
    """Members convert to int, and are equal to nothing but themselves."""

    def __int__(self) -> int:
        return self.value

    __index__ = __int__
    __hash__ = object.__hash__  # members are one each, and sets of them are asked for often


class NumberEnum(IndexEnum):
    """Members are equal to their numbers, too."""

    def __eq__(self, other: object) -> bool:
        return self is other or (not isinstance(other, enum.Enum) and self._value_ == other)

    def __hash__(self) -> int:
        return hash(self._value_)


class BoundEnum(IndexEnum):
    """Members have an order, too."""

    def _compare(self, other: object, sign: int) -> bool:
        if type(other) is not type(self):
            raise TypeError(f"{self} and {other!r} cannot be ordered")
        return sign * self.value < sign * other.value

    def __lt__(self, other: object) -> bool:
        return self._compare(other, 1)

    def __gt__(self, other: object) -> bool:
        return self._compare(other, -1)

    def __le__(self, other: object) -> bool:
        return not self > other

    def __ge__(self, other: object) -> bool:
        return not self < other
