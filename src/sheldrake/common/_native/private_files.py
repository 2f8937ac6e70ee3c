"""The cache folder, with compiled kernels: what lies there is run, so nobody but the user may have put it there."""

from __future__ import annotations

import errno
import functools
import os
import pathlib
import stat
import sys
import tempfile
import warnings

MOST = 1 << 28
"""No file there has more bytes than this."""
_OTHERS_WRITE = stat.S_IWGRP | stat.S_IWOTH


def root() -> pathlib.Path:
    """SHELDRAKE_CACHE_DIR, else `sheldrake` in the cache folder that the operating system gives this user.

    A variable that is empty or no absolute path counts as unset: the current folder may be anybody's.
    """
    given = _absolute("SHELDRAKE_CACHE_DIR")
    return given if given is not None else users_caches() / "sheldrake"


def users_caches() -> pathlib.Path:
    """Where the operating system wants this user's caches."""
    home = _home()
    if home is None:
        return pathlib.Path(tempfile.gettempdir()) / f"caches-of-{os.getuid() if hasattr(os, 'getuid') else 'user'}"
    if sys.platform == "win32":
        return _absolute("LOCALAPPDATA") or home / "AppData" / "Local"
    if sys.platform == "darwin":
        return home / "Library" / "Caches"
    return _absolute("XDG_CACHE_HOME") or home / ".cache"


def _absolute(variable: str) -> pathlib.Path | None:
    """The path in an environment variable, if it is absolute."""
    return _if_absolute(os.environ.get(variable, ""))


@functools.lru_cache(16)
def _if_absolute(text: str) -> pathlib.Path | None:
    path = pathlib.Path(text)
    return path if path.is_absolute() else None


def _home() -> pathlib.Path | None:
    """The user's home folder: as the environment says, else the operating system."""
    if sys.platform == "win32":
        home = pathlib.Path(os.path.expanduser("~"))
        return home if home.is_absolute() else None
    if (home_of_environment := _absolute("HOME")) is not None:
        return home_of_environment
    import pwd  # not above: Windows has none

    try:
        home = pathlib.Path(pwd.getpwuid(os.getuid()).pw_dir)
    except KeyError:
        return None
    return home if home.is_absolute() else None


def read(path: pathlib.Path) -> bytes | None:
    """What a file in a folder of caches holds; None where there is none, or one that is refused, with a warning."""
    if not is_trusted(path.parent):
        return None
    try:
        descriptor = _open(path)
    except OSError as error:
        if error.errno == errno.ELOOP:
            _refuse(str(path), "is a link")
        return None
    with os.fdopen(descriptor, "rb") as file:
        found = os.fstat(descriptor)
        reason = _fault(found)
        if not stat.S_ISREG(found.st_mode):
            reason = "is no regular file"
        elif found.st_size > MOST:
            reason = f"has {found.st_size} bytes"
        if reason:
            _refuse(str(path), reason)
            return None
        return file.read(found.st_size)


def _open(path: pathlib.Path) -> int:
    """A descriptor of a file itself, of no link to one, in the folder that this user alone may write.

    The folder is asked once more when it is open: what its path names may have been exchanged since `is_trusted`.

    Raises:
        OSError: there is no such file, or the folder is another's.
    """
    flags = os.O_RDONLY | sum(getattr(os, name, 0) for name in ("O_NONBLOCK", "O_BINARY", "O_NOFOLLOW"))
    if os.open not in os.supports_dir_fd:
        return os.open(path, flags)
    folder = os.open(path.parent, os.O_RDONLY | os.O_DIRECTORY)
    try:
        if reason := _fault(os.fstat(folder)):
            _refuse(str(path.parent), reason)
            raise PermissionError(reason)
        return os.open(path.name, flags, dir_fd=folder)
    finally:
        os.close(folder)


def is_trusted(folder: pathlib.Path) -> bool:
    """Whether a folder of caches, and the one that it lies in, belong to this user alone, as far as they exist."""
    for place in (folder.parent, folder):
        try:
            reason = _fault(os.stat(place))
        except OSError:
            continue
        if reason:
            _refuse(str(place), reason)
            return False
    return True


def make(folder: pathlib.Path) -> None:
    """Makes a folder, and those that it lies in, which others may not write."""
    if not folder.is_dir():
        make(folder.parent)
        folder.mkdir(mode=0o700, exist_ok=True)


def write(path: pathlib.Path, data: bytes) -> None:
    """Writes a file beside its place, then renames it; leaves nothing behind when that fails.

    Raises:
        OSError: it cannot be written.
    """
    make(path.parent)
    descriptor, temporary = tempfile.mkstemp(dir=path.parent)
    try:
        with os.fdopen(descriptor, "wb") as file:
            file.write(data)
        os.replace(temporary, path)
    except BaseException:
        os.unlink(temporary)
        raise


def _fault(found: os.stat_result) -> str:
    if not hasattr(os, "geteuid"):
        return ""
    if found.st_uid != os.geteuid():
        return f"belongs to user {found.st_uid}, not to you"
    return "may be written by others (chmod go-w)" if stat.S_IMODE(found.st_mode) & _OTHERS_WRITE else ""


@functools.cache
def _refuse(path: str, reason: str) -> None:
    warnings.warn(f"Compiled kernels and hulls in {path} are not used: it {reason}.", stacklevel=2)
