"""Names of robots in place of files: `sheldrake view go2` finds it in what is installed."""

from __future__ import annotations

import difflib
import importlib
import importlib.metadata
import importlib.util
import os
import pathlib
from collections.abc import Iterator

_ENDINGS = (".urdf", ".sdf", ".xml", ".dmd.yaml")
_FOLDERS = ("_description", "_data")
_ROBOTS = "example-robot-data"
_DESCRIPTIONS = "robot_descriptions"


def find_model(name: str) -> str:
    """Returns the file that is meant: a file or a package:// address as it is, else a robot of an installed package.

    Looks in the models of sheldrake, in the package example-robot-data, and in robot_descriptions, which fetches what
    it describes when it is first asked for.

    Raises:
        FileNotFoundError: when nothing is called so; says where it looked, and what is called nearly so.
    """
    is_path = "/" in name or os.sep in name or name.endswith((*_ENDINGS, ".obj", ".stl", ".gltf", ".glb", ".dae"))
    if is_path or os.path.exists(name):
        return name
    known: dict[str, pathlib.Path] = {}
    looked = []
    for place, files in (("sheldrake's models", _own_files()), (_ROBOTS, _robot_files())):
        found = {key: file for file in files for key in _names_of(file)}
        looked.append(place if found else f"{place} (not installed: pip install {place})")
        known = {**found, **known}
    longer = sorted((key for key in known if key.startswith(f"{name}_")), key=len)
    if name in known or longer:
        return str(known[name if name in known else longer[0]])
    described, place = _described(name)
    if described is not None:
        return described
    close = difflib.get_close_matches(name, known, n=3, cutoff=0.7)
    hint = f" Did you mean {' or '.join(repr(match) for match in close)}?" if close else ""
    raise FileNotFoundError(
        f"there is no file {name!r} (looked from {os.getcwd()}), and no robot is called so in "
        f"{', '.join([*looked, place])}.{hint}"
    )


def _names_of(file: pathlib.Path) -> Iterator[str]:
    """What a description answers to: the robot's own file to the name of its folder, too."""
    stem = file.name.partition(".")[0]
    yield stem
    folder = next((part for part in file.parts if part.endswith(_FOLDERS)), "")
    robot = folder.rpartition("_")[0]
    if robot and _main_file(file, robot):
        yield robot


def _main_file(file: pathlib.Path, robot: str) -> bool:
    """Whether a file is the one that is meant by the name of its robot: no other there is called more like it."""
    rivals = sorted((f for f in file.parent.iterdir() if f.name.endswith(_ENDINGS)), key=lambda f: _distance(f, robot))
    return bool(rivals) and rivals[0].name == file.name


def _distance(file: pathlib.Path, robot: str) -> tuple[bool, int, str]:
    return (not file.name.startswith(robot), len(file.name), file.name)


def _own_files() -> list[pathlib.Path]:
    import sheldrake

    return _descriptions_in(pathlib.Path(sheldrake.model_path("two_hole_block/two_hole_block.urdf")).parents[1])


def _robot_files() -> list[pathlib.Path]:
    """The descriptions of an installed example-robot-data; none without it."""
    try:
        files = importlib.metadata.files(_ROBOTS) or []
    except importlib.metadata.PackageNotFoundError:
        return []
    for file in files:
        if _ROBOTS in file.parts and "robots" in file.parts:
            depth = len(file.parts) - file.parts.index("robots") - 2
            return _descriptions_in(pathlib.Path(str(file.locate())).resolve().parents[depth])
    return []


def _descriptions_in(folder: pathlib.Path) -> list[pathlib.Path]:
    return sorted(path for path in folder.rglob("*") if path.name.endswith(_ENDINGS) and path.name != "package.xml")


def _described(name: str) -> tuple[str | None, str]:
    """The file that robot_descriptions has under a name, None without it; and what to say of where that was looked."""
    if importlib.util.find_spec(_DESCRIPTIONS) is None:
        return None, f"{_DESCRIPTIONS} (not installed: pip install {_DESCRIPTIONS})"
    for ending, attribute in (("_description", "URDF_PATH"), ("_mj_description", "MJCF_PATH")):
        module = f"{_DESCRIPTIONS}.{name}{ending}"
        if importlib.util.find_spec(module) is not None:
            return str(getattr(importlib.import_module(module), attribute)), _DESCRIPTIONS
    return None, _DESCRIPTIONS
