"""Files in memory, checksums, resources and temporary folders."""

from __future__ import annotations

import contextlib
import copy
import errno
import functools
import glob
import hashlib
import os
import secrets
import stat
import sys
import tempfile
from collections.abc import Iterator
from functools import total_ordering
from pathlib import Path
from types import SimpleNamespace
from typing import Any, ClassVar

from sheldrake.common._checked import checked
from sheldrake.common._overloads import incompatible


@total_ordering
class Sha256:
    """A SHA-256 checksum; without arguments all zeros."""

    def __init__(self) -> None:
        self._hex = "0" * 64

    @staticmethod
    def Checksum(data: str | bytes) -> Sha256:
        """The checksum of some text (as UTF-8) or bytes."""
        if not isinstance(data, (str, bytes)):
            raise incompatible("Sha256.Checksum", ["(str or bytes)"], (data,), {})
        return Sha256._of(hashlib.sha256(data.encode() if isinstance(data, str) else data).hexdigest())

    @staticmethod
    def Parse(text: str, /) -> Sha256 | None:
        """The checksum written as 64 hexadecimal digits, or None if it is not."""
        if len(text) != 64 or not set(text.lower()) <= set("0123456789abcdef"):
            return None
        return Sha256._of(text.lower())

    @staticmethod
    def _of(digits: str) -> Sha256:
        new = Sha256()
        new._hex = digits
        return new

    def to_string(self) -> str:
        """64 hexadecimal digits."""
        return self._hex

    def __eq__(self, other: object) -> bool:
        return self._hex == other._hex if isinstance(other, Sha256) else NotImplemented

    def __lt__(self, other: object) -> bool:
        return self._hex < other._hex if isinstance(other, Sha256) else NotImplemented

    def __hash__(self) -> int:
        return hash(self._hex)

    def __repr__(self) -> str:
        return f"Sha256({self._hex!r})"


class MemoryFile:
    """A file held in memory: its contents, its extension, and a name for messages."""

    __fields__: ClassVar[tuple] = (
        SimpleNamespace(name="contents", type=bytes),
        SimpleNamespace(name="extension", type=str),
        SimpleNamespace(name="filename_hint", type=str),
    )

    @checked
    def __init__(self, contents: str | bytes = b"", extension: str = "", filename_hint: str = ""):
        """
        Args:
            contents: Bytes, or text (as UTF-8).
            extension: Empty or like ".obj"; stored in lower case.
            filename_hint: A name for messages, on one line.

        Raises:
            RuntimeError: extension or name are not so.
        """
        if not isinstance(contents, (str, bytes)) or not isinstance(extension, str):
            accepted = ["()", "(contents: str or bytes, extension: str, filename_hint: str)"]
            raise incompatible("MemoryFile", accepted, (contents, extension, filename_hint), {}, constructor=True)
        if extension and not (extension.startswith(".") and len(extension) > 1):
            raise RuntimeError(
                f"MemoryFile given invalid extension. Must be empty or of the form '.foo'; given '{extension}'."
            )
        if "\n" in filename_hint:
            raise RuntimeError(f"MemoryFile(): the filename_hint {filename_hint!r} must be on one line.")
        self._contents = contents.encode() if isinstance(contents, str) else contents
        self._extension = extension.lower()
        self._filename_hint = filename_hint

    @staticmethod
    def Make(path: str | os.PathLike) -> MemoryFile:
        """The file at `path`, read.

        Raises:
            RuntimeError: it cannot be read.
        """
        try:
            contents = regular_bytes(path)
        except OSError as error:
            raise RuntimeError(f"MemoryFile::Make() cannot read the file '{path}': {error.strerror}.") from None
        return MemoryFile(contents, Path(path).suffix, str(path))

    def contents(self) -> bytes:
        """All bytes."""
        return self._contents

    def extension(self) -> str:
        """The extension in lower case, with its dot; or empty."""
        return self._extension

    def filename_hint(self) -> str:
        """The name for messages."""
        return self._filename_hint

    def sha256(self) -> Sha256:
        """Checksum of the contents."""
        return Sha256.Checksum(self._contents)

    def _yaml_get(self, name: str) -> Any:
        return getattr(self, f"_{name}")

    def _yaml_set(self, name: str, value: object) -> None:
        fields = {field.name: self._yaml_get(field.name) for field in self.__fields__}
        MemoryFile.__init__(self, **{**fields, name: value})

    def __setattr__(self, name: str, value: object) -> None:
        if name in ("contents", "extension", "filename_hint"):
            self._yaml_set(name, value)
        else:
            object.__setattr__(self, name, value)

    def __copy__(self) -> MemoryFile:
        return MemoryFile(self._contents, self._extension, self._filename_hint)

    def __deepcopy__(self, memo: dict) -> MemoryFile:
        return copy.copy(self)

    def __repr__(self) -> str:
        shown = repr(self._contents) if len(self._contents) <= 100 else f"<{self._contents[:100]!r}...>"
        return f"MemoryFile(contents={shown}, extension={self._extension!r}, filename_hint={self._filename_hint!r})"


def regular_bytes(path: str | os.PathLike, most: int = 1 << 30) -> bytes:
    """What a regular file holds; a pipe or a device, which may never end, is refused at once.

    Args:
        path: The file.
        most: More bytes than these are refused.

    Raises:
        OSError: it cannot be read, is no regular file, or is too large.
    """
    name = os.fspath(path)
    descriptor = os.open(name, os.O_RDONLY | getattr(os, "O_NONBLOCK", 0) | getattr(os, "O_BINARY", 0))
    try:
        found = os.fstat(descriptor)
        if not stat.S_ISREG(found.st_mode):
            raise OSError(errno.EINVAL, "it is no regular file", name)
        if found.st_size > most:
            raise OSError(errno.EFBIG, f"it has {found.st_size} bytes, and no more than {most} are read", name)
        with os.fdopen(descriptor, "rb", closefd=False) as file:
            return file.read(found.st_size)
    finally:
        os.close(descriptor)


@contextlib.contextmanager
def whole_file(path: str | os.PathLike, **options: Any) -> Iterator[Any]:
    """A new file that takes the place of `path` once all of it is written; what was there stays if that fails.

    Args:
        path: The file; a pipe or a device is written as it is.
        options: Of `open` for text (encoding, newline); without any, the file takes bytes.

    Raises:
        OSError: it cannot be written; nothing is left behind.
    """
    place, kind = Path(os.path.realpath(path)), "" if options else "b"
    if place.exists() and not place.is_file():
        with open(place, f"w{kind}", **options) as file:
            yield file
        return
    part = place.with_name(f".{place.name[:100]}.{secrets.token_hex(8)}")
    try:
        with open(part, f"x{kind}", **options) as file:
            yield file
        os.replace(part, place)
    except BaseException:
        part.unlink(missing_ok=True)
        raise


def _resource_roots() -> list[Path]:
    """The folders that hold `drake/`: the one that is named, and that of the `drake` wheel."""
    named, wheel = os.environ.get("DRAKE_RESOURCE_ROOT"), _share_of_wheel(_installed())
    return [Path(root) for root in (named, wheel) if root]


def _installed() -> tuple[tuple[str, int], ...]:
    """The folders that Python imports from, and when something was last installed in each."""
    found = []
    for folder in sys.path:
        with contextlib.suppress(OSError):
            found.append((folder, os.stat(folder or os.curdir).st_mtime_ns))
    return tuple(found)


@functools.lru_cache(maxsize=4)
def _share_of_wheel(installed: tuple[tuple[str, int], ...]) -> str | None:
    """The folder of resources of the `drake` wheel among these folders: to look costs as much as a small model.

    Its own metadata tell that it is there; `importlib.metadata` would load the package for mails.
    """
    for folder, _ in installed:
        share = os.path.join(folder, "pydrake", "share")
        has_drake = os.path.isdir(os.path.join(share, "drake"))
        if has_drake and glob.glob(os.path.join(glob.escape(folder), "drake-*.dist-info")):
            return share
    return None


def GetDrakePath() -> str | None:
    """The folder of Drake's resources: `$DRAKE_RESOURCE_ROOT/drake`, or the `drake` wheel's; None without both."""
    return next((str(root / "drake") for root in _resource_roots() if (root / "drake").is_dir()), None)


def FindResourceOrThrow(resource_path: str) -> str:
    """The absolute path of a resource.

    Args:
        resource_path: Relative, beginning with "drake/"; looked for in `$DRAKE_RESOURCE_ROOT`, then in the `drake`
            wheel, if that is installed.

    Raises:
        RuntimeError: there is no such file, or the path is not so.
    """
    if Path(resource_path).is_absolute():
        raise RuntimeError(f"Drake resource_path '{resource_path}' is not a relative path.")
    if not resource_path.startswith("drake/"):
        raise RuntimeError(f"Drake resource_path '{resource_path}' does not start with drake/.")
    roots = _resource_roots()
    for root in roots:
        if (root / resource_path).is_file():
            return str(root / resource_path)
    looked = ", ".join(map(str, roots)) or "no folder"
    raise RuntimeError(
        f"Could not find Drake resource_path '{resource_path}'. Looked in {looked}. Set "
        "DRAKE_RESOURCE_ROOT to the folder that holds `drake/`, such as `share` of a Drake installation."
    )


def temp_directory() -> str:
    """A new folder for temporary files, in `$TEST_TMPDIR`, `$TMPDIR` or the system's place. Nobody removes it."""
    return tempfile.mkdtemp(prefix="robotlocomotion_drake_", dir=os.environ.get("TEST_TMPDIR"))
