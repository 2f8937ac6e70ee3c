"""Numbers, vectors and words that SDFormat writes as the text of elements."""

from .._files.xml import Element
from .._reading.reading import Reading


def text_number(element: Element, reading: Reading, infinite: bool = False) -> float:
    """The number that an element has as its text."""
    return reading.parse_number(element.text, element.where, f"<{element.tag}>", infinite)


def child_number(element: Element, tag: str, reading: Reading, default=None, infinite: bool = False):
    """The number in a child's text, or `default` when there is no such child."""
    child = element.find(tag)
    return default if child is None else text_number(child, reading, infinite)


def child_vector(element: Element, tag: str, size: int, reading: Reading, default=None):
    """The vector in a child's text, shape (size,), or `default` when there is no such child."""
    child = element.find(tag)
    if child is None:
        return default
    return reading.parse_vector(child.text, size, child.where, f"<{child.tag}>")


def child_text(element: Element, tag: str, default: str = "") -> str:
    """The text of a child without surrounding white space."""
    child = element.find(tag)
    return default if child is None else child.text.strip()
