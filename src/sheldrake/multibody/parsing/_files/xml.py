"""Reads XML into a small tree that remembers file, line and column; refuses entities and absurd input.

expat is used instead of lxml because it gives a column and has no line limit. Model files in the wild were mostly
written for lenient readers, so two harmless deviations from XML are accepted: white space before the XML declaration
and `--` inside comments. What tinyxml2, which Drake reads with, understands besides is read with a warning (`_mend`).
"""

import functools
import os
import re
from xml.parsers import expat

from sheldrake.common._files import regular_bytes

from .diagnostics import DiagnosticPolicy, Location

MAX_BYTES = 64 * 1024 * 1024  # [bytes] of one XML file; the largest robot description we know has 1 MB
MAX_DEPTH = 500  # levels of nested elements
MAX_ELEMENTS = 1_000_000
_INVALID_TOKEN = expat.ErrorString(expat.errors.codes[expat.errors.XML_ERROR_INVALID_TOKEN])

_COMMENT_OR_CDATA = re.compile(rb"<!--|<!\[CDATA\[")


class Element:
    """One XML element.

    Attributes:
        tag: Its name as written, prefix included (`drake:joint`).
        attributes: Attribute values by name, in file order.
        children: Child elements in file order.
        text: The character data directly inside it, joined.
    """

    __slots__ = ("__dict__", "_offset", "_source", "attributes", "children", "column", "line", "tag", "text")

    def __init__(self, tag: str, attributes: "dict[str, str]", source: "_Source", line: int, column: int, offset: int):
        self.tag = tag
        self.attributes = attributes
        self.children: list[Element] = []
        self.text = ""
        self.line = line
        self.column = column
        self._source = source
        self._offset = offset

    @property
    def where(self) -> Location:
        """The place of the opening bracket."""
        return Location(self._source.name, self.line, self.column)

    def where_attribute(self, name: str) -> Location:
        """The place of an attribute's name; the element's own place when the attribute is not there."""
        line, column = self._places.get(name.encode(), (self.line, self.column))
        return Location(self._source.name, line, column)

    @functools.cached_property
    def _places(self) -> "dict[bytes, tuple[int, int]]":
        """Line and column of each attribute's name: all at once, as an element may have very many."""
        data, found = self._source.data, {}
        line, line_begin, seen = self.line, self._offset - self.column, self._offset
        match = _NAME.match(data, self._offset)
        while match and (match := _ATTRIBUTE.match(data, match.end())):
            start, name = match.start(2), match[2].rstrip(b" \t\r\n=")
            if newlines := data.count(b"\n", seen, start):
                line, line_begin = line + newlines, data.rfind(b"\n", seen, start)
            found[name], seen = (line, start - line_begin), start
        return found

    def get(self, name: str, default=None):
        """The value of an attribute, or `default`."""
        return self.attributes.get(name, default)

    def find(self, tag: str) -> "Element | None":
        """The first child of that name, or None."""
        return next((child for child in self.children if child.tag == tag), None)

    def find_all(self, *tags: str) -> "list[Element]":
        """The children of any of those names, in file order."""
        return [child for child in self.children if child.tag in tags]

    def renamed(self, tag: str) -> "Element":
        """A copy with another tag, at the same place, sharing the children."""
        copy = Element(tag, dict(self.attributes), self._source, self.line, self.column, self._offset)
        copy.children = list(self.children)
        copy.text = self.text
        return copy

    def __iter__(self):
        return iter(self.children)

    def __repr__(self) -> str:
        return f"<{self.tag}> at {self.where}"


class _Source:
    """The bytes and the name of a file, shared by its elements."""

    def __init__(self, name: str, data: bytes):
        self.name = name
        self.data = data


class _TreeBuilder:
    """Receives expat's events and makes `Element`s of them."""

    def __init__(self, source: _Source, skipped_lines: int, policy: DiagnosticPolicy):
        self.root: Element | None = None
        self._stack: list[Element] = []
        self._count = 0
        self._source = source
        self._skipped_lines = skipped_lines
        self._policy = policy
        self.parser = expat.ParserCreate()
        self.parser.buffer_text = True
        self.parser.StartElementHandler = self._start
        self.parser.EndElementHandler = self._end
        self.parser.CharacterDataHandler = self._characters
        self.parser.StartDoctypeDeclHandler = self._doctype
        self.parser.EntityDeclHandler = self._entity

    def here(self) -> Location:
        return Location(
            self._source.name,
            self.parser.CurrentLineNumber + self._skipped_lines,
            self.parser.CurrentColumnNumber + 1,
        )

    def _start(self, tag: str, attributes: "dict[str, str]") -> None:
        self._count += 1
        if self._count > MAX_ELEMENTS:
            self._policy.Error(self.here(), f"The file has more than {MAX_ELEMENTS} elements; this is refused.")
        if len(self._stack) >= MAX_DEPTH:
            self._policy.Error(self.here(), f"Elements are nested deeper than {MAX_DEPTH} levels; this is refused.")
        where = self.here()
        element = Element(tag, attributes, self._source, where.line, where.column, self.parser.CurrentByteIndex)
        if self._stack:
            self._stack[-1].children.append(element)
        else:
            self.root = element
        self._stack.append(element)

    def _end(self, _tag: str) -> None:
        self._stack.pop()

    def _characters(self, data: str) -> None:
        self._stack[-1].text += data

    def explain(self, error: expat.ExpatError) -> str:
        """What expat found, and what the reader of the message can do about it."""
        text, at = self._source.data, self.parser.ErrorByteIndex
        found = expat.ErrorString(error.code)
        if found == _INVALID_TOKEN and text.lstrip()[:1] == b"<":  # what is no XML may be anybody's: it is not quoted
            found = f"invalid token at {text[at : at + 20].decode('utf-8', 'replace')!r}"
        if self._stack:
            return f"{found}; the innermost open element is the <{self._stack[-1].tag}> of line {self._stack[-1].line}."
        if self.root is not None:
            return f"{found}; the document ended with </{self.root.tag}> before this."
        return f"{found}; a model is one element, such as <robot> or <sdf>."

    def _doctype(self, _name, system_id, public_id, _has_internal_subset) -> None:
        if system_id or public_id:
            self._policy.Error(
                self.here(),
                f"The document type names an external definition ('{system_id or public_id}'); external definitions "
                "are never read. Remove the <!DOCTYPE ...> line.",
            )

    def _entity(self, name, *_args) -> None:
        self._policy.Error(
            self.here(), f"The document declares the entity '{name}'; entities are refused. Write its text out instead."
        )


def parse_xml(data: "bytes | str", name: str, policy: DiagnosticPolicy) -> Element:
    """The root element of an XML text.

    Args:
        data: The text; bytes may carry their own encoding declaration.
        name: What messages call it: a path, or `<literal-string>.urdf`.
        policy: Receives what is wrong.

    Raises:
        ParseError: For text that is not XML, declares entities, or is larger than any model file is.
    """
    if isinstance(data, str):
        data = data.encode("utf-8", "surrogatepass")
        encoding = "utf-8"
    else:
        encoding = None
    if len(data) > MAX_BYTES:
        policy.Error(Location(name), f"The XML text has {len(data)} bytes; more than {MAX_BYTES} are refused.")
    data, skipped_lines = _make_strict(data)
    builder = _TreeBuilder(_Source(name, data), skipped_lines, policy)
    try:
        try:
            _feed(builder.parser, data, encoding)
        except expat.ExpatError as error:
            mended, faults = _mend(data)
            second = _TreeBuilder(_Source(name, mended), skipped_lines, policy)
            if not faults or not _is_fed(second.parser, mended, encoding):
                where = Location(name, error.lineno + skipped_lines, error.offset + 1)
                policy.Error(where, f"This is not well-formed XML: {builder.explain(error)}")
            builder = second
            for at, text in faults:
                line = 1 + data.count(b"\n", 0, at)
                where = Location(name, line + skipped_lines, at - data.rfind(b"\n", 0, at))
                policy.Warning(where, f"This is not well-formed XML: {text}.")
    except (LookupError, ValueError) as error:
        policy.Error(Location(name, 1), f"The text cannot be decoded: {error}.")
    if builder.root is None:
        policy.Error(Location(name), "The document is empty.")
    return builder.root


def _feed(parser, data: bytes, encoding: "str | None") -> None:
    """Runs expat over the text; text that came as `str` is UTF-8 whatever its declaration says."""
    if encoding is not None:
        data = re.sub(rb'^(<\?xml[^>]*?)\s+encoding\s*=\s*("[^"]*"|\'[^\']*\')', rb"\1", data, count=1)
    parser.Parse(data, True)


def _is_fed(parser, data: bytes, encoding: "str | None") -> bool:
    try:
        _feed(parser, data, encoding)
    except expat.ExpatError:
        return False
    return True


_DECLARATION = re.compile(rb"<\?xml\b.*?\?>", re.DOTALL)
_GOOD_DECLARATION = re.compile(
    rb"""<\?xml\s+version\s*=\s*("1\.\d"|'1\.\d')(\s+encoding\s*=\s*("[\w.-]+"|'[\w.-]+'))?"""
    rb"""(\s+standalone\s*=\s*("(yes|no)"|'(yes|no)'))?\s*\?>"""
)
_NAME = re.compile(rb"""<[^\s<>/"'=]+""")
_ATTRIBUTE = re.compile(rb"""(\s*)([^\s=<>/"']+\s*=\s*)("[^"]*"|'[^']*')""")
_CLOSE = re.compile(rb"\s*/?>")
_BARE_AMPERSAND = re.compile(rb"&(?!(?:amp|lt|gt|quot|apos|#\d+|#x[0-9a-fA-F]+);)")
_CONTROL = re.compile(rb"[\x00-\x08\x0b\x0c\x0e-\x1f]")


def _mend(data: bytes) -> "tuple[bytes, list[tuple[int, str]]]":
    """The text as tinyxml2 understands it, in XML, and what was wrong, each with its offset.

    A malformed or second declaration means nothing, nor does text before the root; `&` stands for itself where no
    character reference begins, so do `<` and control characters in values; attributes need no space between them, and
    what follows the root is not read.
    """
    faults: list[tuple[int, str]] = []
    at, out = _declarations(data, faults)
    depth = 0
    while (tag := data.find(b"<", at)) >= 0:
        out.append(_text_of(data, at, tag, faults))
        is_end = data.startswith(b"</", tag)
        if is_end or data.startswith((b"<!", b"<?"), tag):
            closing = b"]]>" if data.startswith(b"<![CDATA[", tag) else b">"
            at = data.find(closing, tag) + len(closing)
            if at < len(closing):
                break
            out.append(data[tag:at])
            depth -= is_end
            if not is_end:
                continue
        else:
            at = _start_tag(data, tag, out, faults)
            if at < 0:
                break
            depth += data[at - 2 : at] != b"/>"
        if depth == 0:
            rest = data[at:].lstrip()
            if rest.startswith(b"<"):
                faults.append((len(data) - len(rest), "what follows the root element is ignored"))
                return b"".join(out), faults
            return b"".join(out) + rest, faults
    return data, []


def _declarations(data: bytes, faults: "list[tuple[int, str]]") -> "tuple[int, list[bytes]]":
    """Where the XML declarations end, and what stays of them."""
    at, out = 0, []
    while (start := data.find(b"<", at)) >= 0:
        if text := data[at:start].strip():
            faults.append((at + data[at:start].index(text[:1]), "text before the root element is ignored"))
        out.append(re.sub(rb"[^\n]", b" ", data[at:start]))
        at = start
        if (declaration := _DECLARATION.match(data, at)) is None:
            break
        if at == 0 and _GOOD_DECLARATION.fullmatch(declaration.group()):
            out.append(declaration.group())
        else:
            faults.append((at, "the declaration is malformed or not the first, and is ignored"))
            out.append(re.sub(rb"[^\n]", b" ", declaration.group()))
        at = declaration.end()
    return at, out


def _start_tag(data: bytes, tag: int, out: "list[bytes]", faults: "list[tuple[int, str]]") -> int:
    """Adds a tag with its attributes to `out`; where it ends, or -1 where it cannot be read."""
    name = _NAME.match(data, tag)
    if name is None:
        return -1
    out.append(name.group())
    at = name.end()
    while (attribute := _ATTRIBUTE.match(data, at)) is not None:
        space, key, value = attribute.groups()
        if not space:
            faults.append((at, "a space is missing before this attribute"))
        if b"<" in value:
            faults.append((attribute.start(3) + value.index(b"<"), "'<' in a value is taken as it is"))
        at = attribute.end()
        out += [space or b" ", key, _text_of(data, attribute.start(3), at, faults).replace(b"<", b"&lt;")]
    close = _CLOSE.match(data, at)
    if close is None:
        return -1
    out.append(close.group())
    return close.end()


def _text_of(data: bytes, start: int, end: int, faults: "list[tuple[int, str]]") -> bytes:
    """Text or a value, in which `&` begins character references alone."""
    part = data[start:end]
    for match in _BARE_AMPERSAND.finditer(part):
        faults.append((start + match.start(), "'&' begins no character reference, and is taken as it is"))
    for match in _CONTROL.finditer(part):
        faults.append((start + match.start(), "a control character is ignored"))
    return _CONTROL.sub(b"", _BARE_AMPERSAND.sub(b"&amp;", part))


def _make_strict(data: bytes) -> "tuple[bytes, int]":
    """The text without leading white space (and how many lines that was) and with blanked comments.

    Blanking keeps every byte offset and line, and makes `--` inside comments harmless. UTF-16 is left alone.
    """
    if data[:2] in (b"\xff\xfe", b"\xfe\xff"):
        return data, 0
    stripped = data.lstrip(b" \t\r\n")
    skipped_lines = data.count(b"\n", 0, len(data) - len(stripped))

    out, at = [], 0
    while (opening := _COMMENT_OR_CDATA.search(stripped, at)) is not None:
        is_comment = opening.group() == b"<!--"
        end = stripped.find(b"-->" if is_comment else b"]]>", opening.end()) + 3
        if end < 3:
            break
        text = stripped[opening.start() : end]
        out += [stripped[at : opening.start()], re.sub(rb"[^\n]", b" ", text) if is_comment else text]
        at = end
    return b"".join(out) + stripped[at:], skipped_lines


def read_xml(path: "str | os.PathLike", policy: DiagnosticPolicy) -> Element:
    """The root element of an XML file.

    Raises:
        ParseError: As `parse_xml`, and when the file cannot be read.
    """
    path = os.fspath(path)
    return parse_xml(read_bytes(path, policy), path, policy)


def read_bytes(path: str, policy: DiagnosticPolicy) -> bytes:
    """What is in an XML file.

    Raises:
        ParseError: When the file cannot be read or is larger than any model file is.
    """
    try:
        size = os.path.getsize(path)
        if size > MAX_BYTES:
            policy.Error(Location(path), f"The file has {size} bytes; XML files above {MAX_BYTES} are refused.")
        return regular_bytes(path, MAX_BYTES)
    except OSError as error:
        policy.Error(Location(path), f"The file cannot be read: {error.strerror}.")
