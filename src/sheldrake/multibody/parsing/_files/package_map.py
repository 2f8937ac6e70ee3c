"""Where packages named by `package://` and `model://` addresses live on this machine."""

import copy
import functools
import json
import logging
import os
import pathlib
import urllib.parse

from sheldrake.common._checked import checked
from sheldrake.common._files import GetDrakePath

from . import remote_package
from .diagnostics import DiagnosticPolicy, Location, ParseError
from .remote_package import check_remote, fetch_remote
from .xml import read_xml

_LOG = logging.getLogger("drake")

SCHEMES = ("file", "model", "package")
_IGNORE_MARKERS = ("AMENT_IGNORE", "CATKIN_IGNORE", "COLCON_IGNORE")
_MAX_FOLDERS = 200_000  # folders visited by one search for package.xml; a mistaken path such as "/" ends here

# The models that Drake's own releases point to, fetched when first used.
_DRAKE_MODELS = remote_package.RemoteParams(
    urls=["https://github.com/RobotLocomotion/models/archive/deee02d4d79937e112cb428e638e7ee44d51305f.tar.gz"],
    sha256="9f5bc1b923e4de584a030d17c1fcfedfc1ca29e805c453156cab297e6bb89054",
    strip_prefix="models-deee02d4d79937e112cb428e638e7ee44d51305f/",
)


def _drake_models(drake_root: "str | None") -> remote_package.RemoteParams:
    """The models that the Drake of a folder of resources points to; those above without one."""
    try:
        with open(os.path.join(drake_root or "", "multibody", "parsing", "drake_models.json"), "rb") as file:
            said = json.load(file)
        fields = {name: said[name] for name in ("urls", "sha256", "strip_prefix")}
    except (OSError, ValueError, KeyError, TypeError):
        return copy.deepcopy(_DRAKE_MODELS)
    return remote_package.RemoteParams(**fields)


class PackageMap:
    """Maps package names to folders.

    A new map knows `drake_models` (downloaded when first used, or found in Drake's cache) and, when Drake's resource
    files are on this machine (an installed `drake` wheel, or `DRAKE_RESOURCE_ROOT`), also `drake`; the models are then
    those of that Drake.
    """

    RemoteParams = remote_package.RemoteParams

    @checked
    def __init__(self, other: "PackageMap | None" = None):
        if other is not None:
            self._paths, self._remotes = dict(other._paths), copy.deepcopy(other._remotes)

    # What a new map knows takes as long to find as a small model to read: it is sought when somebody asks.

    @functools.cached_property
    def _paths(self) -> "dict[str, str]":
        return {} if self._drake_root is None else {"drake": self._drake_root}

    @functools.cached_property
    def _remotes(self) -> "dict[str, remote_package.RemoteParams]":
        return {"drake_models": _drake_models(self._drake_root)}

    @functools.cached_property
    def _drake_root(self) -> "str | None":
        return GetDrakePath()

    @staticmethod
    def MakeEmpty() -> "PackageMap":
        """A map that knows no package."""
        result = PackageMap.__new__(PackageMap)
        result._paths = {}
        result._remotes = {}
        return result

    def __copy__(self) -> "PackageMap":
        return PackageMap(self)

    def __deepcopy__(self, _memo) -> "PackageMap":
        return PackageMap(self)

    def __repr__(self) -> str:
        return f"<PackageMap with {self.size()} packages: {', '.join(self.GetPackageNames())}>"

    def Add(self, package_name: str, package_path: "str | os.PathLike") -> None:
        """Adds a package that lives in the folder `package_path`.

        Raises:
            RuntimeError: When the folder does not exist, or the name already stands for another folder.
        """
        path = os.fspath(package_path)
        if not os.path.isdir(path):
            raise RuntimeError(f"PackageMap.Add(): the folder '{path}' of package '{package_name}' does not exist.")
        self._insert(package_name, path, "Add()")

    @checked
    def AddMap(self, other_map: "PackageMap") -> None:
        """Adds every package of another map.

        Raises:
            RuntimeError: When a name stands for different places in the two maps; then nothing is added.
        """
        merged = PackageMap(self)
        for name, path in other_map._paths.items():
            merged._insert(name, path, "AddMap()")
        for name, params in other_map._remotes.items():
            merged._insert_remote(name, params, "AddMap()")
        self._paths, self._remotes = merged._paths, merged._remotes

    def AddPackageXml(self, filename: "str | os.PathLike") -> None:
        """Adds the package described by a `package.xml` file; its folder is the package's.

        Raises:
            RuntimeError: When the file cannot be read, names no package, or the name already stands for another folder.
        """
        path = os.fspath(filename)
        self._insert(_package_name(path), os.path.dirname(os.path.abspath(path)), "AddPackageXml()")

    @checked
    def AddRemote(self, package_name: str, params: remote_package.RemoteParams) -> None:
        """Adds a package that is downloaded, checked against its SHA-256 sum and unpacked when first used.

        Raises:
            RuntimeError: When `params` is not usable or the name already stands for something else.
        """
        check_remote(package_name, params)
        self._insert_remote(package_name, copy.deepcopy(params), "AddRemote()")

    @checked
    def Contains(self, package_name: str) -> bool:
        """True when the map knows this package."""
        return package_name in self._paths or package_name in self._remotes

    @checked
    def Remove(self, package_name: str) -> None:
        """Forgets a package.

        Raises:
            RuntimeError: When the map does not know it.
        """
        if not self.Contains(package_name):
            raise RuntimeError(f"PackageMap.Remove(): {self._unknown(package_name)}")
        self._paths.pop(package_name, None)
        self._remotes.pop(package_name, None)

    def size(self) -> int:
        """How many packages the map knows."""
        return len(self.GetPackageNames())

    def GetPackageNames(self) -> "list[str]":
        """The names of all packages, sorted."""
        return sorted(self._paths.keys() | self._remotes.keys())

    @checked
    def GetPath(self, package_name: str) -> str:
        """The folder of a package; a remote package is downloaded first.

        Raises:
            RuntimeError: When the map does not know the package, or a download fails.
        """
        if package_name in self._paths:
            return self._paths[package_name]
        if package_name in self._remotes:
            return fetch_remote(package_name, self._remotes[package_name])
        raise RuntimeError(f"PackageMap.GetPath(): {self._unknown(package_name)}")

    @checked
    def ResolveUrl(self, url: str) -> str:
        """The path of the file that a `package://`, `model://` or `file://` address stands for.

        Raises:
            RuntimeError: When the address has another form, names an unknown package, leaves its package through
                `..`, or the file does not exist.
        """
        return resolve_uri(url, self, None, Location("ResolveUrl()"), DiagnosticPolicy())

    def PopulateFromFolder(self, path: "str | os.PathLike") -> None:
        """Adds every package below a folder: each folder with a `package.xml`; conflicts are logged and skipped."""
        self._crawl(os.fspath(path), stop_at_packages=False)

    def PopulateFromEnvironment(self, environment_variable: str) -> None:
        """Searches the folders listed in an environment variable as `PopulateFromFolder` does.

        Raises:
            RuntimeError: For ROS_PACKAGE_PATH, which has rules of its own (`PopulateFromRosPackagePath`).
        """
        if environment_variable == "ROS_PACKAGE_PATH":
            raise RuntimeError(
                "PackageMap.PopulateFromEnvironment(): for ROS_PACKAGE_PATH call PopulateFromRosPackagePath()."
            )
        for path in _split_paths(environment_variable):
            self._crawl(path, stop_at_packages=False)

    def PopulateFromRosPackagePath(self) -> None:
        """Searches ROS_PACKAGE_PATH as ROS does: not below packages, nor below folders with an ignore marker."""
        for path in _split_paths("ROS_PACKAGE_PATH"):
            self._crawl(path, stop_at_packages=True)

    def PopulateUpstreamToDrake(self, model_file: "str | os.PathLike") -> None:
        """Retired: adds the packages around a model file; these are found without it today."""
        import warnings

        from sheldrake.common.deprecation import DrakeDeprecationWarning

        text = "PackageMap.PopulateUpstreamToDrake() is retired: packages around a model file are found without it."
        warnings.warn(text, DrakeDeprecationWarning, stacklevel=2)
        folder = os.path.dirname(os.path.abspath(os.fspath(model_file)))
        while folder != os.path.dirname(folder):
            if os.path.isfile(os.path.join(folder, "package.xml")):
                self._insert_found(os.path.join(folder, "package.xml"))
            folder = os.path.dirname(folder)

    def _crawl(self, root: str, stop_at_packages: bool) -> None:
        if not os.path.isdir(root):
            _LOG.warning("PackageMap: the folder '%s' cannot be opened.", root)
            return
        visited = 0
        for folder, subfolders, files in os.walk(root):
            visited += 1
            if visited > _MAX_FOLDERS:
                raise RuntimeError(f"PackageMap: gave up after {_MAX_FOLDERS} folders below '{root}'.")
            subfolders.sort()
            if stop_at_packages and any(marker in files for marker in _IGNORE_MARKERS):
                subfolders.clear()
                continue
            if "package.xml" in files:
                self._insert_found(os.path.join(folder, "package.xml"))
                if stop_at_packages:
                    subfolders.clear()

    def _insert_found(self, package_xml: str) -> None:
        """Adds a package met during a search; a name that is taken is logged and keeps its old folder."""
        name, folder = _package_name(package_xml), os.path.dirname(package_xml)
        known = self._paths.get(name)
        if known is None and name not in self._remotes:
            self._paths[name] = folder
        elif known is None or not _same_folder(known, folder):
            kept = known or "the remote package"
            _LOG.warning("PackageMap: package '%s' at '%s' is ignored, %s is kept.", name, folder, kept)

    def _insert(self, name: str, path: str, call: str) -> None:
        known = self._paths.get(name)
        if name in self._remotes:
            raise RuntimeError(f"PackageMap.{call}: package '{name}' is already known as a remote package.")
        if known is not None and not _same_folder(known, path):
            raise RuntimeError(f"PackageMap.{call}: package '{name}' is already known at '{known}', not '{path}'.")
        self._paths.setdefault(name, path)

    def _insert_remote(self, name: str, params: remote_package.RemoteParams, call: str) -> None:
        if name in self._paths:
            raise RuntimeError(f"PackageMap.{call}: package '{name}' is already known at '{self._paths[name]}'.")
        known = self._remotes.get(name)
        if known is not None and known.ToJson() != params.ToJson():
            raise RuntimeError(f"PackageMap.{call}: package '{name}' is already known with other remote parameters.")
        self._remotes.setdefault(name, params)

    def _unknown(self, name: str) -> str:
        return f"unknown package '{name}'; the known packages are {', '.join(self.GetPackageNames()) or '(none)'}."


def resolve_uri(uri: str, packages: PackageMap, folder: "str | None", where: Location, policy: DiagnosticPolicy) -> str:
    """The path of the file that an address in a model file stands for.

    Args:
        uri: `package://name/path`, `model://name/path`, `file:///path`, or a path; relative paths start at `folder` and
            stay in the package around it, where there is one.
        packages: The known packages.
        folder: The folder of the model file; None when the model is a string.
        where: The place of the address, for messages.
        policy: Receives errors.

    Raises:
        ParseError: When the file cannot be located; the message lists where it was looked for.
    """
    scheme, separator, rest = uri.partition("://")
    if not separator:
        path = _resolve_plain(uri, folder, where, policy)
    elif scheme == "file":
        path = urllib.parse.unquote(rest) if "%" in rest else rest
        if not os.path.isabs(path):
            policy.Error(
                where,
                f"URI '{uri}' is not absolute: write file:///folder/name with three slashes, or leave out file:// for "
                "a path that begins at the folder of this file.",
            )
    elif scheme in ("package", "model"):
        path = _resolve_in_package(uri, rest, packages, folder, where, policy)
    else:
        known = ", ".join(f"{name}://" for name in SCHEMES)
        policy.Error(where, f"URI '{uri}' has the unsupported scheme '{scheme}://'; supported are {known}.")
    if not os.path.exists(path):
        policy.Error(where, f"URI '{uri}' resolved to '{path}' which does not exist.")
    return path


def _resolve_plain(uri: str, folder: "str | None", where: Location, policy: DiagnosticPolicy) -> str:
    if os.path.isabs(uri):
        return os.path.normpath(uri)
    if folder is None:
        policy.Error(
            where,
            f"URI '{uri}' is a relative path, which is invalid when parsing a string instead of a filename; use a "
            "file with AddModels(), an absolute path, or a package:// address.",
        )
    path = os.path.normpath(os.path.join(folder, uri))
    package = _package_around(folder) if os.pardir in pathlib.PurePath(uri).parts else None
    if package is not None and not path.startswith(package.rstrip(os.sep) + os.sep):
        policy.Error(
            where,
            f"URI '{uri}' leaves the package of this file (folder '{package}') through '..'; this is refused. Name the "
            "other package, package://name/path, or give an absolute path.",
        )
    return path


def _package_around(folder: str) -> "str | None":
    """The closest folder, this one or one above, that holds a package.xml."""
    current, above = os.path.normpath(os.path.abspath(folder)), ""
    while current != above:
        if os.path.isfile(os.path.join(current, "package.xml")):
            return current
        current, above = os.path.dirname(current), current
    return None


def _resolve_in_package(uri: str, rest: str, packages, folder, where: Location, policy: DiagnosticPolicy) -> str:
    if rest.startswith("/"):
        policy.Warning(where, f"URI '{uri}' has three slashes; the package name follows the second.")
    name, _, inside = rest.lstrip("/").partition("/")
    if packages.Contains(name):
        try:
            root = packages.GetPath(name)
        except ParseError:
            raise
        except RuntimeError as error:
            policy.Error(where, f"URI '{uri}': {error}")
    else:
        root, looked_at = _find_package_above(name, inside, folder)
        if root is None:
            looked = f" Looked above '{folder}' too: {', '.join(looked_at)}." if looked_at else ""
            policy.Error(
                where,
                f"URI '{uri}' refers to unknown package '{name}'. Known packages: "
                f"{', '.join(packages.GetPackageNames()) or '(none)'}; add it with "
                f"parser.package_map().Add('{name}', folder).{looked}",
            )
        _LOG.info("%s: package '%s' is not in the package map; found at '%s'.", where, name, root)
    path = os.path.normpath(os.path.join(root, inside))
    if path != os.path.normpath(root) and not path.startswith(os.path.normpath(root).rstrip(os.sep) + os.sep):
        policy.Error(where, f"URI '{uri}' leaves its package '{name}' (folder '{root}') through '..'; this is refused.")
    return path


def _find_package_above(name: str, inside: str, folder: "str | None") -> "tuple[str | None, list[str]]":
    """The folder of a package that encloses the model file or stands beside an enclosing folder, and where we looked.

    Robot descriptions are mostly used from a checkout in which the package is one of the folders above the file.
    """
    looked_at: list[str] = []
    if folder is None or not name or name in (os.curdir, os.pardir):
        return None, looked_at
    current = os.path.abspath(folder)
    while True:
        candidates = [os.path.join(current, name)]
        if os.path.basename(current) == name or _declares_package(current, name):
            candidates.insert(0, current)
        for candidate in candidates:
            looked_at.append(candidate)
            if os.path.exists(os.path.join(candidate, inside)) and os.path.isdir(candidate):
                return candidate, looked_at
        parent = os.path.dirname(current)
        if parent == current:
            return None, looked_at
        current = parent


def _declares_package(folder: str, name: str) -> bool:
    package_xml = os.path.join(folder, "package.xml")
    if not os.path.isfile(package_xml):
        return False
    try:
        return _package_name(package_xml) == name
    except RuntimeError:
        return False


def _package_name(package_xml: str) -> str:
    """The `<name>` of a package.xml file.

    Raises:
        RuntimeError: When there is none.
    """
    policy = DiagnosticPolicy()
    root = read_xml(package_xml, policy)
    name = root.find("name")
    if root.tag != "package" or name is None or not name.text.strip():
        policy.Error(root, "A package.xml file needs a <package> with a <name>.")
    return name.text.strip()


def _same_folder(one: str, other: str) -> bool:
    return os.path.realpath(one) == os.path.realpath(other)


def _split_paths(variable: str) -> "list[str]":
    return [path for path in os.environ.get(variable, "").split(os.pathsep) if path]
