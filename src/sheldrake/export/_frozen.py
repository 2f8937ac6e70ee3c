"""A frozen diagram: a description and a block of memory, and the file that has both."""

from __future__ import annotations

import hashlib
import json
import os
from typing import TYPE_CHECKING, Any

from sheldrake.common._files import regular_bytes, whole_file

if TYPE_CHECKING:
    from os import PathLike

VERSION = 1
_MAGIC = b"sheldrake frozen diagram"


class FrozenDiagram:
    """A diagram that needs no Python: `Freeze` makes it, `LoadFrozen` reads it from a file.

    Attributes:
        description: What there is and where, as JSON has it; the format is told in the documentation, "Ship it".
        image: The memory with which it begins, with zeros where addresses belong.
    """

    def __init__(self, description: dict[str, Any], image: bytes):
        self.description, self.image = description, image

    @property
    def name(self) -> str:
        """Name of the diagram."""
        return self.description["name"]

    def state_names(self) -> list[str]:
        """Systems with state."""
        return [s["name"] for s in self.description["states"]]

    def input_names(self) -> list[str]:
        """Input ports that take values: what is connected inside does not."""
        return [s["name"] for s in self.description["inputs"]]

    def output_names(self) -> list[str]:
        """Output ports that can be asked for."""
        return [s["name"] for s in self.description["outputs"]]

    def parameter_names(self) -> list[str]:
        """Groups of numeric parameters."""
        return [s["name"] for s in self.description["parameters"]]

    def log_names(self) -> list[str]:
        """What is logged."""
        return [s["name"] for s in self.description["logs"]]

    def left_out(self) -> list[str]:
        """Systems that are not in it because they only publish, such as visualizers."""
        return list(self.description["left_out"])

    def ToBytes(self) -> bytes:
        """What `Save` writes. The same diagram in the same state gives the same bytes."""
        text = json.dumps(self.description, sort_keys=True, separators=(",", ":"), allow_nan=False).encode()
        body = b"%d\n" % len(text) + text + self.image
        return b"%s %d\n%s\n" % (_MAGIC, VERSION, hashlib.sha256(body).hexdigest().encode()) + body

    def Save(self, path: str | PathLike[str]) -> None:
        """Writes a file that `LoadFrozen` reads.

        Raises:
            OSError: the file cannot be written.
        """
        with whole_file(path) as file:
            file.write(self.ToBytes())


def LoadFrozen(path: str | PathLike[str]) -> FrozenDiagram:
    """Reads a frozen diagram; the script that made it is not needed.

    Such a file is a program: run it only if you would run a program from where it comes.

    Raises:
        OSError: the file cannot be read, or is no regular file.
        ValueError: it is no frozen diagram, of another version, or not as it was written; nothing of it is run.
    """
    name = os.fspath(path)
    return from_bytes(regular_bytes(name), f"LoadFrozen({name!r})")


def from_bytes(data: bytes, call: str) -> FrozenDiagram:
    """What `ToBytes` gave; errors begin with the name of the call.

    Raises:
        ValueError: see `LoadFrozen`.
    """
    first, _, rest = data.partition(b"\n")
    magic, _, version = first.rpartition(b" ")
    if magic != _MAGIC:
        raise ValueError(f"{call}: this is no frozen diagram; those begin with {_MAGIC.decode()!r}.")
    if version != b"%d" % VERSION:
        found = version.decode("ascii", "replace")
        raise ValueError(
            f"{call}: the format has version {found}, and this sheldrake reads version {VERSION}; freeze it anew."
        )
    digest, _, body = rest.partition(b"\n")
    if hashlib.sha256(body).hexdigest().encode() != digest:
        raise ValueError(f"{call}: it is not as it was written, truncated or altered (its SHA-256 differs).")
    size, _, behind = body.partition(b"\n")
    try:
        end = int(size)
        description = json.loads(behind[:end])
        whole = len(behind) - end == 8 * description["memory"]["size"]
    except (ValueError, LookupError, TypeError, RecursionError) as error:
        raise ValueError(f"{call}: what it says of the diagram can not be read: {error}.") from None
    if not whole:
        raise ValueError(f"{call}: its memory is not as large as it says.")
    return FrozenDiagram(description, behind[end:])
