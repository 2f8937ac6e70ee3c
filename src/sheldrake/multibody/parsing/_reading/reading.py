"""What every reader of a model format needs: files, messages, numbers."""

from __future__ import annotations

import math
import os
import re
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, NoReturn

import numpy as np

from .._files.diagnostics import DiagnosticPolicy, Location, Placed
from .._files.package_map import PackageMap, resolve_uri
from .._files.xml import Element, parse_xml, read_bytes
from .remembered import Address, Questions

if TYPE_CHECKING:
    from collections.abc import Iterable

    from numpy.typing import ArrayLike

    from sheldrake.math import RigidTransform, RotationMatrix

_NUMBER = re.compile(r"[+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?")
_BEGIN_OF_NUMBER = re.compile(rf"({_NUMBER.pattern})(?![xX])")
_INFINITY = re.compile(r"[+-]?inf(?:inity)?", re.IGNORECASE)

INCLUDE_DEPTH = 30  # files that include files
INCLUDE_COUNT = 1000  # files that one file brings with it, each as often as it is included


@dataclass
class Reading:
    """The surroundings of one file that is being read.

    Attributes:
        policy: Receives warnings and errors.
        packages: Where packages live.
        source: What messages call the input.
        folder: The folder relative file names start at; None for a string.
        wants_geometry: False when the plant has no scene graph: then shapes, and the files they name, are not read.
        includes: The files being read right now, outermost first.
        num_bodies: Bodies the plant has already, the world included; MJCF numbers nameless bodies from there.
        num_actuators: Actuators the plant has already, likewise.
        joint_friction: Whether friction of joints in URDF is to be had.
        strictly_refused: What no one reads and strict parsing refuses, as Drake does; None means all of it.
        documents: The roots of all XML read, that of included files too.
        refuse_undefined: Of (element, child, reading), called for children that no one reads; fails where the format
            has no such element.
        refuse_undefined_attribute: Likewise, of (element, attribute, reading).
        loose_numbers: Whether what follows a number in a word is passed over, with a warning; so it is in SDFormat.
        checked: Places of the elements whose children and attributes were compared with what is read.
        passed_over: Places of the elements that are left out knowingly, with all that is in them.
        questions: What was asked of files and packages.
    """

    policy: DiagnosticPolicy
    packages: PackageMap
    source: str
    folder: str | None
    wants_geometry: bool
    includes: tuple[str, ...] = ()
    num_bodies: int = 1
    num_actuators: int = 0
    joint_friction: bool = False
    strictly_refused: tuple[str, ...] | None = None
    refuse_undefined: Callable[[Element, Element, Reading], None] | None = None
    refuse_undefined_attribute: Callable[[Element, str, Reading], None] | None = None
    loose_numbers: bool = False
    documents: list[Element] = field(default_factory=list)
    checked: set[Location] = field(default_factory=set)
    passed_over: set[Location] = field(default_factory=set)
    questions: Questions = field(default_factory=Questions)

    def warn(self, where: Location | Placed, message: str) -> None:
        """Reports a warning at an element, description or location."""
        self.policy.Warning(where, message)

    def fail(self, where: Location | Placed, message: str) -> NoReturn:
        """Reports an error; never returns.

        Raises:
            ParseError: Always.
        """
        self.policy.Error(where, message)

    def inside(self, path: str, where: Location) -> Reading:
        """The surroundings of a file included at `where`.

        Raises:
            ParseError: When the file is already being read, or inclusion is nested too deeply.
        """
        real = os.path.realpath(path)
        if real in self.includes:
            self.fail(where, f"The file '{path}' includes itself.")
        if len(self.includes) >= INCLUDE_DEPTH:
            self.fail(where, f"Files include each other deeper than {INCLUDE_DEPTH} levels.")
        return replace(self, source=path, folder=os.path.dirname(path), includes=(*self.includes, real))

    def open_document(self, text: str | None = None) -> Element:
        """The root element of the file that is read, or of a text in its place.

        Raises:
            ParseError: When it is not XML, or one file too many.
        """
        if len(self.documents) > INCLUDE_COUNT:
            self.fail(Location(self.source), f"More than {INCLUDE_COUNT} files are included.")
        root = self.read_xml(self.source) if text is None else parse_xml(text, self.source, self.policy)
        self.documents.append(root)
        return root

    def read_xml(self, path: str) -> Element:
        """The root element of another file.

        Raises:
            ParseError: When it is not XML.
        """
        data = read_bytes(path, self.policy)
        self.questions.files[path] = data
        return parse_xml(data, path, self.policy)

    def resolve(self, uri: str, where: Location) -> str:
        """The path a file name or address stands for.

        Raises:
            ParseError: When there is no such file.
        """
        path = resolve_uri(uri.strip(), self.packages, self.folder, where, self.policy)
        self.questions.addresses[Address(uri.strip(), self.folder)] = path
        return path

    def name(self, element: Element, what: str, attribute: str = "name") -> str:
        """A name that must be there and not be empty.

        Raises:
            ParseError: When it is missing or empty.
        """
        value = element.get(attribute)
        if value is None or not value.strip():
            problem = "is missing the" if value is None else "has an empty"
            self.fail(element, f"{what} {problem} attribute '{attribute}'.")
        return value

    def number(self, element: Element, attribute: str, default=None, infinite: bool = False):
        """The value of a numeric attribute, or `default` when it is absent.

        Raises:
            ParseError: When the text is not one finite number (or infinity, where allowed).
        """
        text = element.get(attribute)
        if text is None:
            return default
        if (value := _number_in(text, infinite)) is not None:  # the place is looked for where it is told
            return value
        return self.parse_number(text, element.where_attribute(attribute), f"attribute '{attribute}'", infinite)

    def vector(self, element: Element, attribute: str, size: int, default=None):
        """The value of a numeric vector attribute, shape (size,), or `default` when it is absent.

        Raises:
            ParseError: When the text is not `size` finite numbers.
        """
        text = element.get(attribute)
        if text is None:
            return default
        values = [_number_in(word) for word in text.split()]
        if len(values) == size and None not in values:
            return np.array(values, dtype=float)
        return self.parse_vector(text, size, element.where_attribute(attribute), f"attribute '{attribute}'")

    def parse_number(self, text: str, where: Location, what: str, infinite: bool = False) -> float:
        """One number from text; `what` names it in messages."""
        if (value := _number_in(text, infinite)) is not None:
            return value
        begin = _BEGIN_OF_NUMBER.match(text.strip()) if self.loose_numbers else None
        if begin is not None and math.isfinite(float(begin[0])):
            self.policy.Note(where, f"{what}: expected a number, found '{_shorten(text)}'; {begin[0]} is taken.")
            return float(begin[0])
        self.fail(where, f"{what}: expected one finite number, found '{_shorten(text)}'.")

    def parse_vector(self, text: str, size: int | None, where: Location, what: str) -> np.ndarray:
        """Numbers separated by white space, shape (size,); any number of them when `size` is None."""
        words = text.split()
        if size is not None and len(words) != size:
            self.fail(where, f"{what}: expected {size} numbers, found '{_shorten(text)}'.")
        return np.array([self.parse_number(word, where, what) for word in words], dtype=float)

    def parse_bool(self, text: str, where: Location, what: str) -> bool:
        """A truth value: true, false, 1 or 0."""
        value = {"true": True, "1": True, "false": False, "0": False}.get(text.strip().lower())
        if value is None:
            self.fail(where, f"{what}: expected true or false, found '{_shorten(text)}'.")
        return value

    def warn_unknown(
        self, element: Element, tags: Iterable[str] = (), attributes: Iterable[str] = (), silent: Iterable[str] = ()
    ) -> None:
        """Warns about children and attributes that no one reads, so that nothing is dropped silently.

        Those in `silent` are left out without a word: they are for other programs, and Drake has no word for them.
        """
        self.checked.add(element.where)
        for child in element:
            if child.tag in tags:
                continue
            self.passed_over.add(child.where)
            if child.tag in silent:
                continue
            if self.refuse_undefined is not None:
                self.refuse_undefined(element, child, self)
            message = f"The element <{child.tag}> inside <{element.tag}> is not supported and is ignored."
            self._warn_unread(child, child.tag, message)
        for attribute in element.attributes:
            if attribute not in attributes and attribute not in silent and not attribute.startswith("xmlns"):
                if self.refuse_undefined_attribute is not None:
                    self.refuse_undefined_attribute(element, attribute, self)
                where = element.where_attribute(attribute)
                message = f"The attribute '{attribute}' of <{element.tag}> is not supported and is ignored."
                self._warn_unread(where, attribute, message)

    def note_unknown(self, element: Element, tags: Iterable[str] = (), attributes: Iterable[str] = ()) -> None:
        """Does the same where Drake has no word for them, so that strict parsing does not mind."""
        replace(self, strictly_refused=()).warn_unknown(element, tags, attributes)

    def pass_over(self, *elements: Element) -> None:
        """Leaves elements out, with all that is in them: a message was given, or no one could miss them."""
        self.passed_over.update(element.where for element in elements)

    def warn_unchecked(self) -> None:
        """Warns about what is in elements that no reader has checked; those with nothing but text are fine."""
        rest = list(self.documents)
        while rest:
            element = rest.pop()
            if element.where in self.passed_over:
                continue
            if element.where not in self.checked:
                self.note_unknown(element)
            rest += element.children

    def _warn_unread(self, where: Location | Placed, name: str, message: str) -> None:
        refused = self.strictly_refused is None or name in self.strictly_refused
        (self.policy.Warning if refused else self.policy.Note)(where, message)


def _shorten(text: str, limit: int = 60) -> str:
    text = " ".join(text.split())
    return text if len(text) <= limit else text[:limit] + "..."


def _number_in(text: str, infinite: bool = False) -> float | None:
    """The number that text is, finite unless it may be infinite; None: it is none."""
    stripped = text.strip()
    if _NUMBER.fullmatch(stripped) or (infinite and _INFINITY.fullmatch(stripped)):
        value = float(stripped)
        if infinite or math.isfinite(value):
            return value
    return None


def make_pose(xyz: ArrayLike, rpy: ArrayLike) -> RigidTransform:
    """The pose with translation `xyz` [m] and space-fixed roll, pitch, yaw [rad]."""
    from sheldrake.math import RigidTransform, RollPitchYaw

    return RigidTransform(RollPitchYaw(np.asarray(rpy, dtype=float)), np.asarray(xyz, dtype=float))


def rotation_from_z(direction: np.ndarray) -> RotationMatrix:
    """The smallest rotation that turns the z-axis into `direction`, shape (3,), of any length but zero.

    Rodrigues' formula with sine and cosine from the cross and dot product; half a turn about x when they are opposite.
    """
    from sheldrake.math import RotationMatrix

    d = np.asarray(direction, dtype=float) / np.linalg.norm(direction)
    cosine = d[2]
    if cosine <= -1.0 + 1e-12:
        return RotationMatrix.MakeXRotation(np.pi)
    K = np.array([[0.0, 0.0, d[0]], [0.0, 0.0, d[1]], [-d[0], -d[1], 0.0]])
    return RotationMatrix(np.eye(3) + K + K @ K / (1.0 + cosine))
