"""Packages that are downloaded when first used: checked by SHA-256, unpacked into the user's cache folder."""

import hashlib
import json
import os
import re
import shutil
import tempfile
from typing import Any

from sheldrake.common._options import Options

_TIMEOUT = 30.0  # [s] without a byte
_ARCHIVE_TYPES = ("zip", "tar", "gztar", "bztar", "xztar")


class RemoteParams(Options):
    """What to download for a remote package.

    Attributes:
        urls: Addresses of one archive (http, https or file), tried in turn.
        sha256: The archive's SHA-256 sum, 64 lower-case hexadecimal digits.
        archive_type: zip, tar, gztar, bztar or xztar; by default from the address.
        strip_prefix: A leading folder inside the archive that is dropped.
    """

    urls: list[str] = []
    sha256: str = ""
    archive_type: str | None = None
    strip_prefix: str | None = None

    def ToJson(self) -> str:
        """The fields that are set, as JSON with sorted keys."""
        fields = {f.name: getattr(self, f.name) for f in self.__fields__ if getattr(self, f.name) is not None}
        return json.dumps(fields, sort_keys=True, separators=(",", ":"))


def check_remote(name: str, params: RemoteParams) -> None:
    """Checks the parameters of a remote package.

    Raises:
        RuntimeError: When there is no address, an address or archive type is not supported, or the sum is malformed.
    """
    call = f"PackageMap.AddRemote(): package '{name}'"
    if not params.urls:
        raise RuntimeError(f"{call} needs at least one URL.")
    for url in params.urls:
        if not url.startswith(("http://", "https://", "file://")):
            raise RuntimeError(f"{call} has the unsupported URL '{url}'; http://, https:// and file:// are supported.")
    if re.fullmatch("[0-9a-f]{64}", params.sha256) is None:
        raise RuntimeError(f"{call} has the invalid sha256 '{params.sha256}'; expected 64 lower-case hex digits.")
    if params.archive_type is not None and params.archive_type not in _ARCHIVE_TYPES:
        known = ", ".join(_ARCHIVE_TYPES)
        raise RuntimeError(f"{call} has the unsupported archive_type '{params.archive_type}'; supported: {known}.")


def fetch_remote(name: str, params: RemoteParams) -> str:
    """The folder with the unpacked package, downloaded now unless this library's cache or Drake's has it.

    Raises:
        RuntimeError: When no address gives the right archive, or networking is switched off (DRAKE_ALLOW_NETWORK).
    """
    folder = os.path.join(_cache_root(), params.sha256 + _suffix(params))
    for cached in (folder, _in_drakes_cache(params)):
        if os.path.isdir(cached):
            return cached
    os.makedirs(os.path.dirname(folder), exist_ok=True)
    with tempfile.TemporaryDirectory(dir=os.path.dirname(folder)) as scratch:
        archive = os.path.join(scratch, "archive")
        _download(name, params, archive)
        unpacked = os.path.join(scratch, "unpacked")
        _unpack(archive, params, unpacked)
        inner = os.path.normpath(os.path.join(unpacked, params.strip_prefix or ""))
        if not inner.startswith(unpacked) or not os.path.isdir(inner):
            raise RuntimeError(f"PackageMap: the archive of '{name}' has no folder '{params.strip_prefix}'.")
        try:
            os.replace(inner, folder)
        except OSError:
            if not os.path.isdir(folder):  # another process was faster: then its copy is ours
                raise
    return folder


def _cache_root() -> str:
    from sheldrake.common._native.private_files import users_caches

    return str(users_caches() / "sheldrake" / "package_map")


def _in_drakes_cache(params: RemoteParams) -> str:
    """Where Drake would have put the same package: named by both sums."""
    root = os.environ.get("XDG_CACHE_HOME") or os.path.join(os.path.expanduser("~"), ".cache")
    stripped = hashlib.sha256((params.strip_prefix or "").rstrip("/").encode()).hexdigest()
    return os.path.join(root, "drake", "package_map", f"{params.sha256}-{stripped}")


def _suffix(params: RemoteParams) -> str:
    """Two uses of one archive with different stripping are different folders."""
    if params.strip_prefix is None:
        return ""
    return "-" + hashlib.sha256(params.strip_prefix.encode()).hexdigest()[:8]


def _network_allowed() -> bool:
    allowed = os.environ.get("DRAKE_ALLOW_NETWORK")
    if not allowed:
        return True
    names = allowed.split(":")
    return "package_map" in names and "none" not in names


def _download(name: str, params: RemoteParams, target: str) -> None:
    import urllib.error  # not above: most processes fetch nothing
    import urllib.request

    failures = []
    for url in params.urls:
        if not url.startswith("file://") and not _network_allowed():
            failures.append(f"{url}: networking is switched off by DRAKE_ALLOW_NETWORK")
            continue
        try:
            with urllib.request.urlopen(url, timeout=_TIMEOUT) as response, open(target, "wb") as file:
                shutil.copyfileobj(response, file)
        except (urllib.error.URLError, OSError, ValueError) as error:
            failures.append(f"{url}: {error}")
            continue
        found = _sha256(target)
        if found == params.sha256:
            return
        failures.append(f"{url}: its sha256 is {found}, expected {params.sha256}")
    raise RuntimeError(f"PackageMap: package '{name}' could not be downloaded. " + "; ".join(failures))


def _sha256(path: str) -> str:
    digest = hashlib.sha256()
    with open(path, "rb") as file:
        for block in iter(lambda: file.read(1 << 20), b""):
            digest.update(block)
    return digest.hexdigest()


def _unpack(archive: str, params: RemoteParams, folder: str) -> None:
    """Unpacks without ever writing outside `folder`."""
    import tarfile
    import zipfile

    kind = params.archive_type
    if kind == "zip" or (kind is None and zipfile.is_zipfile(archive)):
        with zipfile.ZipFile(archive) as file:
            file.extractall(folder)  # zipfile drops drive letters, leading slashes and ".." itself
        return
    try:
        with tarfile.open(archive) as file:
            if hasattr(tarfile, "data_filter"):
                file.extractall(folder, filter="data")
            else:
                _extract_checked(file, folder)
    except tarfile.TarError as error:
        raise RuntimeError(f"PackageMap: the archive {params.urls} cannot be unpacked: {error}.") from error


def _extract_checked(file: Any, folder: str) -> None:
    """The `data` filter for Python versions without it: plain files and folders inside `folder` only."""
    for member in file.getmembers():
        target = os.path.normpath(os.path.join(folder, member.name))
        if not target.startswith(folder + os.sep) and target != folder:
            raise RuntimeError(f"PackageMap: the archive member '{member.name}' would be written outside its folder.")
        if member.isfile() or member.isdir():
            file.extract(member, folder)
