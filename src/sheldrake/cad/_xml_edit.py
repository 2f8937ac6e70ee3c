"""Changes places in an XML file and leaves every other byte as it is."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING, Any, NamedTuple
from xml.parsers import expat
from xml.sax.saxutils import quoteattr

if TYPE_CHECKING:
    from sheldrake.multibody.parsing._files.diagnostics import Location
    from sheldrake.multibody.parsing._files.xml import Element


class Edit(NamedTuple):
    """Bytes of a file that are replaced."""

    start: int
    end: int
    text: bytes


class XmlSource:
    """Bytes of an XML file, in which edits find the places of elements read by the parser.

    Args:
        data: The file.
        root: Its root element, as the parser reads it.
    """

    def __init__(self, data: bytes, root: Element):
        self.data = data
        self.root = root
        self._shift = len(data) - len(data.lstrip(b" \t\r\n")) if data[:2] not in (b"\xff\xfe", b"\xfe\xff") else 0
        self._ends = _ends(root._source.data)
        self._by_place = {(e.line, e.column): e for e in walk(root)}

    def element_at(self, where: Location) -> Element | None:
        """The element whose place is `where`, or None."""
        return self._by_place.get((where.line, where.column))

    def set_attribute(self, element: Element, name: str, value: str) -> Edit:
        """Gives an element's attribute another value, or adds it."""
        start = element._offset
        tag = element._source.data[start : _tag_end(element._source.data, start)]
        found = re.compile(rb"\s" + re.escape(name.encode()) + rb"\s*=\s*(\"[^\"]*\"|'[^']*')").search(tag)
        quoted = quoteattr(value).encode()
        if found is not None:
            return self._edit(start + found.start(1), start + found.end(1), quoted)
        at = start + len(tag.rstrip(b"/>").rstrip())
        return self._edit(at, at, b" " + name.encode() + b"=" + quoted)

    def replace(self, element: Element, text: str) -> Edit:
        """Puts text in the place of an element."""
        return self._edit(element._offset, self._ends[element._offset], text.encode())

    def append_to(self, element: Element, text: str) -> Edit:
        """Puts text before the end tag of an element, on lines of its own.

        Raises:
            ValueError: The element has no end tag.
        """
        data, end = element._source.data, self._ends[element._offset]
        at = data.rfind(b"</", element._offset, end)
        if at < 0:
            raise ValueError(f"<{element.tag}> at {element.where} is empty.")
        line = data.rfind(b"\n", 0, at) + 1
        at = line if not data[line:at].strip() else at
        return self._edit(at, at, text.encode())

    def _edit(self, start: int, end: int, text: bytes) -> Edit:
        return Edit(start + self._shift, end + self._shift, text)


def apply(data: bytes, edits: list[Edit]) -> bytes:
    """The bytes with all edits made; of edits that touch the same bytes the first in the list is made."""
    made: list[Edit] = []
    for edit in edits:
        if not any((edit.start < other.end and other.start < edit.end) or edit == other for other in made):
            made.append(edit)
    for edit in sorted(made, reverse=True):
        data = data[: edit.start] + edit.text + data[edit.end :]
    return data


def walk(element: Element):
    """An element and all below it."""
    waiting = [element]
    while waiting:
        element = waiting.pop()
        yield element
        waiting.extend(element)


def _tag_end(data: bytes, start: int) -> int:
    """One past the bracket that closes the tag at `start`."""
    quote = None
    for at in range(start, len(data)):
        sign = data[at : at + 1]
        if quote is not None:
            quote = None if sign == quote else quote
        elif sign in (b'"', b"'"):
            quote = sign
        elif sign == b">":
            return at + 1
    return len(data)


def _ends(data: bytes) -> dict[int, int]:
    """For the offset of each element, one past its end."""
    parser = expat.ParserCreate()
    ends: dict[int, int] = {}
    open_elements: list[int] = []

    def begin(tag: str, attributes: Any) -> None:
        open_elements.append(parser.CurrentByteIndex)

    def end(tag: str) -> None:
        start = open_elements.pop()
        opened = _tag_end(data, start)
        closes_itself = data[opened - 2 : opened] == b"/>"
        ends[start] = opened if closes_itself else _tag_end(data, parser.CurrentByteIndex)

    parser.StartElementHandler = begin
    parser.EndElementHandler = end
    parser.Parse(data, True)
    return ends
