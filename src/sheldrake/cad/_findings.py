"""What the doctor finds: findings as data, and the file with what can be put right."""

from __future__ import annotations

import os
import re
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ._xml_edit import Edit, apply

if TYPE_CHECKING:
    from os import PathLike


@dataclass
class Finding:
    """One fault of a robot description.

    Attributes:
        severity: "error" (wrong, or unusable), "warning" (most probably wrong) or "note".
        code: Its kind, such as "inertia-too-large".
        subject: The link, joint or pair it is about.
        message: What is wrong, with numbers.
        file: The file.
        line: Where in it, from 1; 0 when that is not known.
        column: Likewise.
        fix: What would put it right; "" when nobody can know from the file.
        is_fixable: Whether `Diagnosis.WriteFixed` does that.
    """

    severity: str
    code: str
    subject: str
    message: str
    file: str
    line: int = 0
    column: int = 0
    fix: str = ""
    edits: list[Edit] = field(default_factory=list, repr=False)

    @property
    def is_fixable(self) -> bool:
        """Whether `Diagnosis.WriteFixed` puts this right."""
        return bool(self.edits)

    def __str__(self) -> str:
        place = self.file + (f":{self.line}" if self.line else "") + (f":{self.column}" if self.column else "")
        fix = f"\n    fix: {self.fix}" if self.fix else ""
        return f"{place}: {self.severity}: {self.message} [{self.code}]{fix}"

    def AsDict(self) -> dict[str, Any]:
        """The finding as JSON takes it."""
        names = ("severity", "code", "subject", "message", "file", "line", "column", "fix", "is_fixable")
        return {name: getattr(self, name) for name in names}


_ORDER = {"error": 0, "warning": 1, "note": 2}


@dataclass
class Diagnosis:
    """All findings of a description, the grave ones first.

    Attributes:
        path: The file.
        findings: What was found.
    """

    path: Path
    findings: list[Finding] = field(default_factory=list)
    _data: bytes = field(default=b"", repr=False)

    def errors(self) -> list[Finding]:
        """The findings that are errors."""
        return [finding for finding in self.findings if finding.severity == "error"]

    def warnings(self) -> list[Finding]:
        """The findings that are warnings."""
        return [finding for finding in self.findings if finding.severity == "warning"]

    def sort(self) -> None:
        """Orders the findings by severity, then by place."""
        self.findings.sort(key=lambda f: (_ORDER[f.severity], f.file, f.line, f.column, f.code))

    def WriteFixed(self, path: str | PathLike[str]) -> list[Finding]:
        """Writes the file with what can be fixed, every other byte as it was, and returns the findings fixed.

        Relative file names stay right when the new file lies in another folder.

        Raises:
            ValueError: The format of the file is one whose faults are only told (MJCF, YAML).
        """
        if self.path.suffix.lower() not in (".urdf", ".sdf"):
            raise ValueError(
                f"'{self.path}': faults of {self.path.suffix} files are found, not fixed; convert it first."
            )
        fixed = [finding for finding in self.findings if finding.edits]
        data = apply(self._data, [edit for finding in fixed for edit in finding.edits])
        path = Path(path)
        old, new = self.path.resolve().parent, path.resolve().parent
        if old != new:
            data = _move_relative_names(data, str(old), str(new))
        path.write_bytes(data)
        return fixed


_NAMES = re.compile(rb"(\bfilename\s*=\s*[\"'])([^\"']+)|(<uri>\s*)([^<]+?)(?=\s*</uri>)")


def _move_relative_names(data: bytes, old: str, new: str) -> bytes:
    def moved(match: re.Match[bytes]) -> bytes:
        before, name = (match[1], match[2]) if match[2] is not None else (match[3], match[4])
        text = name.decode("utf-8", "surrogateescape")
        if "://" in text or os.path.isabs(text) or not os.path.exists(os.path.join(old, text)):
            return match[0]
        moved_name = os.path.relpath(os.path.join(old, text), new).replace(os.sep, "/")
        return before + moved_name.encode("utf-8", "surrogateescape")

    return _NAMES.sub(moved, data)
