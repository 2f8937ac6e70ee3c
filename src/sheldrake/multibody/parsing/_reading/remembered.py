"""Models of files that were read before, given again while reading would find the same.

What a text is read into depends on the text and on what reading asks of its surroundings: the bytes of included files
and where addresses lead. These questions are kept with the models, and asked again before the models are given again.
So a file that changed, a package that moved and a mesh that is gone are seen. Messages are repeated as well.
"""

from __future__ import annotations

import os
import threading
from collections import OrderedDict
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, NamedTuple, NoReturn

from sheldrake.common._files import regular_bytes

from .._files.diagnostics import DiagnosticPolicy, Location, ParseError, Placed, location_of
from .._files.package_map import PackageMap, resolve_uri
from .._files.xml import MAX_BYTES

if TYPE_CHECKING:
    from sheldrake.multibody.parsing._reading.reading import Reading

MOST_BYTES = 16 * 1024 * 1024  # of all texts together, included ones too; a large robot has 200 kB


class Address(NamedTuple):
    """An address that was followed from a folder, as `resolve_uri` takes them."""

    uri: str
    folder: str | None


@dataclass
class Questions:
    """What reading asked of its surroundings, and what was said meanwhile.

    Attributes:
        files: The bytes of every file read, by path.
        addresses: The path each address led to.
        messages: Whether strict parsing minds it, place, text; in order.
        repeatable: False when something was asked that cannot be asked again, such as the mass of a mesh.
    """

    files: dict[str, bytes] = field(default_factory=dict)
    addresses: dict[Address, str] = field(default_factory=dict)
    messages: list[tuple[bool, Location, str]] = field(default_factory=list)
    repeatable: bool = True

    def have_the_same_answers(self, packages: PackageMap) -> bool:
        """Whether all files and addresses are as they were."""
        silent = DiagnosticPolicy()
        silent.SetActionForWarnings(lambda detail: None)
        try:
            for (uri, folder), path in self.addresses.items():
                if resolve_uri(uri, packages, folder, Location(""), silent) != path:
                    return False
            return all(regular_bytes(path, MAX_BYTES) == data for path, data in self.files.items())
        except (OSError, ParseError):
            return False

    def repeat_messages(self, policy: DiagnosticPolicy) -> None:
        """Says again what was said.

        Raises:
            ParseError: When a message is an error now because parsing is strict.
        """
        for strict, where, message in self.messages:
            (policy.Warning if strict else policy.Note)(where, message)


class Listener(DiagnosticPolicy):
    """Hands messages on to a policy, and keeps the warnings."""

    def __init__(self, policy: DiagnosticPolicy, questions: Questions):
        super().__init__()
        self._policy, self._questions = policy, questions

    def Warning(self, where: Location | Placed, message: str) -> None:
        """A warning."""
        self._questions.messages.append((True, location_of(where), message))
        self._policy.Warning(where, message)

    def Note(self, where: Location | Placed, message: str) -> None:
        """A warning that strict parsing does not mind."""
        self._questions.messages.append((False, location_of(where), message))
        self._policy.Note(where, message)

    def Error(self, where: Location | Placed, message: str) -> NoReturn:
        """An error; never returns."""
        self._policy.Error(where, message)


class Remembered(NamedTuple):
    """Models and what they depend on; `size` counts bytes of text."""

    models: list
    questions: Questions
    size: int


_KNOWN: OrderedDict[tuple, Remembered] = OrderedDict()
_LOCK = threading.Lock()


def forget_all() -> None:
    """Makes the next readings begin from nothing."""
    with _LOCK:
        _KNOWN.clear()


def read_or_remember(kind: str, reading: Reading, text: str | None, model_name: str, read: Callable[..., list]) -> list:
    """The models of a file or text: those of an earlier reading, or what `read` finds now.

    They are shared by all who read the same: nobody may change them.

    Args:
        kind: The format.
        reading: The surroundings, a `Reading`.
        text: What to read in place of the file.
        model_name: The name that the caller wants, or "".
        read: Takes kind, reading, text and name.

    Raises:
        ParseError: When the file is not usable.
    """
    key = _key(kind, reading, text, model_name)
    with _LOCK:
        known = _KNOWN.get(key)
        if known is not None:
            _KNOWN.move_to_end(key)
    if known is not None and known.questions.have_the_same_answers(reading.packages):
        known.questions.repeat_messages(reading.policy)
        return known.models
    questions = Questions()
    models = read(kind, _asking(reading, questions), text, model_name)
    if questions.repeatable:
        size = len(text or "") + sum(map(len, questions.files.values()))
        _keep(key, Remembered(models, questions, size))
    return models


def _asking(reading: Reading, questions: Questions) -> Reading:
    return replace(reading, policy=Listener(reading.policy, questions), questions=questions)


def _key(kind: str, reading: Reading, text: str | None, model_name: str) -> tuple:
    """All that a reader knows before it asks anything; relative files of a text begin at the working folder."""
    folder = os.getcwd() if reading.folder is None else reading.folder
    return (
        *(kind, text, model_name, reading.source, folder, reading.folder is None, reading.wants_geometry),
        *(reading.includes, reading.num_bodies, reading.num_actuators, reading.joint_friction),
    )


def _keep(key: tuple, found: Remembered) -> None:
    with _LOCK:
        _KNOWN[key] = found
        _KNOWN.move_to_end(key)
        total = sum(known.size for known in _KNOWN.values())
        while total > MOST_BYTES or len(_KNOWN) > 256:
            total -= _KNOWN.popitem(last=False)[1].size
