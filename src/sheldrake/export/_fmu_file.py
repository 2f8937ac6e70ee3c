"""An FMU of somebody else, looked at before any of it runs: its files, its description, its variables."""

from __future__ import annotations

import difflib
import os
import pathlib
import re
import stat
import tempfile
import weakref
import zipfile
import zlib
from collections.abc import Callable
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

if TYPE_CHECKING:
    from os import PathLike

    from numpy.typing import ArrayLike

_NO_FMPY = "{} needs FMPy: pip install 'sheldrake[fmi]'."
_LARGEST, _SMALL, _MOST_PACKED = 4 << 30, 64 << 20, 200
"""Bytes of an unpacked FMU at most, and beyond which they may be no more than so many times those of the
file: more is taken for an attack."""
_ENCODINGS = {"UTF-8", "UTF8", "US-ASCII", "ASCII", "ISO-8859-1", "ISO-8859-15", "LATIN1", "WINDOWS-1252"}
"""In these, ASCII is ASCII."""

_GETTERS2 = {"Real": "Real", "Integer": "Integer", "Enumeration": "Integer", "Boolean": "Boolean"}
_GETTERS3 = {
    **{kind: kind for kind in ("Float32", "Float64", "Boolean")},
    **{f"{sign}Int{bits}": f"{sign}Int{bits}" for sign in ("", "U") for bits in (8, 16, 32, 64)},
    "Enumeration": "Int64",
}


class FmuVariable(NamedTuple):
    """A variable of numbers.

    Attributes:
        name: Its name.
        reference: Its value reference.
        getter: What calls for its type end with.
        size: How many numbers it has.
    """

    name: str
    reference: int
    getter: str
    size: int

    def encoded(self, value: ArrayLike) -> list[Any]:
        """Numbers as the FMU takes them."""
        numbers = np.ravel(np.asarray(value, float)).tolist()
        if self.getter in ("Real", "Float32", "Float64"):
            return numbers
        return [bool(x) if self.getter == "Boolean" else round(x) for x in numbers]


class FmuFile:
    """An FMU, checked and unpacked into a folder that goes when it does.

    Args:
        path: The file.
        call: What is asked for, for errors.

    Raises:
        ModuleNotFoundError: FMPy is not installed.
        OSError: the file can not be read.
        ValueError: it is damaged, unsafe, of another version or kind, or not for this platform.
    """

    def __init__(self, path: str | PathLike[str], call: str):
        try:
            import fmpy
        except ModuleNotFoundError as error:
            raise ModuleNotFoundError(_NO_FMPY.format(call), name="fmpy") from error
        self.path = os.fspath(path)
        self._call = f"{call}({self.path!r})"
        folder = tempfile.TemporaryDirectory(prefix="sheldrake-fmu-", ignore_cleanup_errors=True)
        self._folder = pathlib.Path(folder.name)
        self._end = weakref.finalize(self, folder.cleanup)
        self._unpack()
        self._description = self._read()
        self.version = "2.0" if self._description.fmiVersion.startswith("2.") else "3.0"
        self.name = self._description.modelName or pathlib.Path(self.path).stem
        self._check_library(fmpy)
        self._left_out: list[str] = []
        self._variables = self._numbers()

    def _fault(self, text: str) -> ValueError:
        return ValueError(f"{self._call}: {text}")

    # Files.

    def _unpack(self) -> None:
        """Unpacks the archive, if all its names stay in it."""
        if os.path.exists(self.path) and not os.path.isfile(self.path):
            raise self._fault("it is no regular file.")
        try:
            with zipfile.ZipFile(self.path) as archive:
                entries = archive.infolist()
                for entry in entries:
                    self._check_entry(entry)
                size = sum(entry.file_size for entry in entries)
                most = min(_LARGEST, max(_SMALL, _MOST_PACKED * os.path.getsize(self.path)))
                if size > most:
                    raise self._fault(f"it would unpack to {size} bytes; more than {most} are not taken.")
                if "modelDescription.xml" not in archive.namelist():
                    raise self._fault("there is no modelDescription.xml in it: it is no FMU.")
                archive.extractall(self._folder)
        except (zipfile.BadZipFile, EOFError, NotImplementedError, RuntimeError, zlib.error) as error:
            raise self._fault(f"it is damaged, or no archive: {error}.") from error

    def _check_entry(self, entry: zipfile.ZipInfo) -> None:
        name = entry.orig_filename
        parts = name.split("/")
        if "\\" in name or ":" in name or "\0" in name or name.startswith("/") or ".." in parts:
            raise self._fault(f"the file {name!r} in it leads out of it; nothing was unpacked.")
        if stat.S_ISLNK(entry.external_attr >> 16):
            raise self._fault(f"the file {name!r} in it is a link; nothing was unpacked.")

    def _read(self) -> Any:
        """The description, after what FMPy's reader does not look at."""
        text = (self._folder / "modelDescription.xml").read_bytes()
        # In an encoding in which "<!" may be other bytes, such as UTF-7, what is looked for next could hide.
        declared = re.match(rb"""(?:\xef\xbb\xbf)?\s*<\?xml[^>]*?encoding\s*=\s*["']([^"']*)""", text)
        encoding = declared[1].decode("ascii", "replace") if declared else "UTF-8"
        if encoding.upper() not in _ENCODINGS or b"\0" in text:
            raise self._fault(f"its modelDescription.xml is in {encoding or 'no encoding'}, and FMI wants UTF-8.")
        if re.search(rb"<!\s*(DOCTYPE|ENTITY)", text, re.IGNORECASE):
            raise self._fault("its modelDescription.xml declares a document type or entities, which FMI does not use.")
        from fmpy import read_model_description

        try:
            found = read_model_description(str(self._folder), validate=False)
        except Exception as error:  # FMPy raises what its parsers do
            raise self._fault(f"its modelDescription.xml can not be understood: {error}") from error
        version = str(found.fmiVersion)
        if not re.match(r"(2|3)\.0", version):
            raise self._fault(f"it is of FMI {version}; 2.0 and 3.0 are understood.")
        if found.coSimulation is None:
            raise self._fault(
                "it is not for co-simulation: one for model exchange brings no solver, one for scheduled execution no "
                "order of its parts."
            )
        if not re.fullmatch(r"[A-Za-z_]\w*", str(found.coSimulation.modelIdentifier), re.ASCII):
            raise self._fault(f"its modelIdentifier {found.coSimulation.modelIdentifier!r} is no identifier of C.")
        return found

    def _check_library(self, fmpy: Any) -> None:
        place = fmpy.platform if self.version == "2.0" else fmpy.platform_tuple
        name = f"{self._description.coSimulation.modelIdentifier}{fmpy.sharedLibraryExtension}"
        if not (self._folder / "binaries" / place / name).is_file():
            there = sorted(p.name for p in (self._folder / "binaries").glob("*") if p.is_dir())
            raise self._fault(
                f"there is no binaries/{place}/{name} in it; it is for {', '.join(there) or 'no platform at all'}."
            )

    # What it can do.

    def takes_any_step(self) -> bool:
        """Whether communication steps may differ."""
        return bool(self._description.coSimulation.canHandleVariableCommunicationStepSize)

    def can_serialize(self) -> bool:
        """Whether its state can be kept and given to another instance."""
        return bool(self._description.coSimulation.canSerializeFMUstate)

    def proposed_step(self) -> float | None:
        """Communication step that it proposes [s]."""
        fixed = self._description.coSimulation.fixedInternalStepSize
        experiment = self._description.defaultExperiment
        found = fixed or (experiment.stepSize if experiment is not None else None)
        return None if found is None else float(found)

    def instantiate(self, hear: Callable[..., None]) -> Any:
        """A new instance, as FMPy has them."""
        from fmpy import instantiate_fmu

        here = os.getcwd()
        try:
            return instantiate_fmu(str(self._folder), self._description, "CoSimulation", logger=hear)
        finally:
            os.chdir(here)  # FMPy stays in the library's folder when that does not load

    # Variables.

    def _numbers(self) -> dict[str, tuple[FmuVariable, Any]]:
        getters = _GETTERS2 if self.version == "2.0" else _GETTERS3
        found = {}
        for v in self._description.modelVariables:
            if v.type in getters and not v.dimensionValueReferences:
                size = int(np.prod(v.shape)) if v.shape else 1
                found[v.name] = FmuVariable(v.name, v.valueReference, getters[v.type], size), v
            elif v.causality in ("input", "output"):
                self._left_out.append(v.name)
        return found

    def left_out(self) -> list[str]:
        """Inputs and outputs that are no numbers."""
        return list(self._left_out)

    def variables(self, causality: str) -> list[FmuVariable]:
        """Inputs, or outputs, in the FMU's order."""
        return [v for v, about in self._variables.values() if about.causality == causality]

    def find(self, name: str, argument: str) -> FmuVariable:
        """A variable by its name.

        Raises:
            ValueError: there is none, or it is no number.
        """
        if name not in self._variables:
            raise self._fault(f"{argument}: there is no variable {name!r} of numbers{choose(name, self._variables)}.")
        return self._variables[name][0]

    def settable(self, name: str, value: ArrayLike) -> tuple[FmuVariable, np.ndarray]:
        """A variable that may be set before the initialization, and its value.

        Raises:
            ValueError: there is none, it is computed, or the value does not suit it.
        """
        variable = self.find(name, "parameters")
        about = self._variables[name][1]
        if about.causality != "input" and about.initial not in ("exact", "approx"):
            raise self._fault(f"parameters: the variable {name!r} is computed by the FMU ({about.causality}).")
        if about.variability == "constant":
            raise self._fault(f"parameters: the variable {name!r} is constant.")
        try:
            given = np.ravel(np.asarray(value, float))
        except (TypeError, ValueError) as error:
            raise self._fault(f"parameters: {name!r} is a number, not {value!r}.") from error
        if given.size != variable.size:
            raise self._fault(f"parameters: {name!r} has {variable.size} elements, not {given.size}.")
        return variable, given


def choose(name: str, known: Any) -> str:
    """Names like one that is not there."""
    close = difflib.get_close_matches(name, list(known), n=3, cutoff=0.4) or list(known)[:5]
    return f"; there are {', '.join(map(repr, close))}" + (", ..." if len(known) > len(close) else "")
