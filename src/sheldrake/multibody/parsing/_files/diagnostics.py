"""Where a message comes from, and what happens to it: one policy for every warning and error of a parse."""

from __future__ import annotations

import logging
from collections.abc import Callable
from typing import NamedTuple, NoReturn, Protocol

_LOG = logging.getLogger("drake")


class Location(NamedTuple):
    """A place in an input file; line and column count from 1, 0 means unknown."""

    source: str
    line: int = 0
    column: int = 0

    def __str__(self) -> str:
        parts = [self.source]
        if self.line:
            parts.append(str(self.line))
            if self.column:
                parts.append(str(self.column))
        return ":".join(parts)


class Placed(Protocol):
    """Something that is at a place in an input file: an element, or a description."""

    @property
    def where(self) -> Location: ...


class ParseError(RuntimeError):
    """A model file that cannot be used, with the place where this was seen.

    Attributes:
        location: The `Location` of the element or attribute at fault.
        problem: The message without the location.
    """

    def __init__(self, location: Location, problem: str):
        super().__init__(f"{location}: error: {problem}")
        self.location = location
        self.problem = problem


class DiagnosticDetail(NamedTuple):
    """One warning or error before it is formatted."""

    location: Location
    message: str

    def FormatWarning(self) -> str:
        """The text `file:line:column: warning: message`."""
        return f"{self.location}: warning: {self.message}"

    def FormatError(self) -> str:
        """The text `file:line:column: error: message`."""
        return f"{self.location}: error: {self.message}"


class DiagnosticPolicy:
    """Decides what a parser does with warnings and errors.

    By default a warning goes to the `drake` logger and an error is raised as `ParseError` (a RuntimeError). An error
    always ends the parse: an action given for errors sees it first.
    """

    def __init__(self):
        self._on_warning: Callable[[DiagnosticDetail], None] | None = None
        self._on_error: Callable[[DiagnosticDetail], None] | None = None
        self.warnings_are_errors = False

    def SetActionForWarnings(self, action: Callable[[DiagnosticDetail], None] | None) -> None:
        """Calls `action(detail)` for every warning from now on; None restores the default."""
        self._on_warning = action

    def SetActionForErrors(self, action: Callable[[DiagnosticDetail], None] | None) -> None:
        """Calls `action(detail)` for every error, before it is raised; None restores the default."""
        self._on_error = action

    def Warning(self, where: Location | Placed, message: str) -> None:
        """Reports a warning at `where` (a `Location` or anything with a `where`).

        Raises:
            ParseError: When parsing is strict.
        """
        if self.warnings_are_errors:
            self.Error(where, message)
        self.Note(where, message)

    def Note(self, where: Location | Placed, message: str) -> None:
        """Reports a warning at `where` that strict parsing does not mind: what Drake passes over in silence."""
        detail = DiagnosticDetail(location_of(where), message)
        if self._on_warning is not None:
            self._on_warning(detail)
        else:
            _LOG.warning("%s", detail.FormatWarning())

    def Error(self, where: Location | Placed, message: str) -> NoReturn:
        """Reports an error at `where`; never returns.

        Raises:
            ParseError: Always.
        """
        location = location_of(where)
        if self._on_error is not None:
            self._on_error(DiagnosticDetail(location, message))
        raise ParseError(location, message)


def location_of(where: Location | Placed) -> Location:
    """The `Location` of an element, a description, or a location itself."""
    return where if isinstance(where, Location) else where.where
