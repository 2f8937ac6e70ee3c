"""Puts inertias of the geometry in the place of impossible ones in a URDF or SDFormat file.

    python -m sheldrake.multibody.fix_inertia robot.urdf better.urdf

Takes the words of Drake's tool of this name. Only what stands in `<inertial>` changes; without an output file the
result goes to the standard output. `sheldrake doctor` finds more, and inertias that are possible but do not fit the
geometry.
"""

from __future__ import annotations

import argparse
import os
import sys
from pathlib import Path
from typing import Any

import numpy as np

_ROLES = ("proximity", "illustration", "perception")
_WATER = 1000.0  # [kg/m^3] of a body whose mass is impossible, too
_MOMENTS = (("ixx", 0, 0), ("ixy", 0, 1), ("ixz", 0, 2), ("iyy", 1, 1), ("iyz", 1, 2), ("izz", 2, 2))


def main(argv: list[str] | None = None) -> int:
    """Runs the tool on the words of a command line; by default the process's own.

    Returns:
        The exit status, 0.

    Raises:
        SystemExit: The words make no sense.
        RuntimeError: The file can not be read.
    """
    options = _parser().parse_args(argv)
    fixed = _fixed(Path(options.input_file), options.geom_inertia_role_order)
    output = options.input_file if options.in_place else options.output_file
    if output is None:
        sys.stdout.write(fixed.decode("utf-8", "replace"))
    else:
        Path(output).write_bytes(fixed)
    return 0


def _parser() -> argparse.ArgumentParser:
    assert __doc__ is not None
    formatter = argparse.RawDescriptionHelpFormatter
    parser = argparse.ArgumentParser(prog="fix_inertia", description=__doc__, formatter_class=formatter)
    parser.add_argument("input_file", help="URDF or SDFormat file")
    parser.add_argument("output_file", nargs="?", help="file to write (default: standard output)")
    parser.add_argument("--in_place", action="store_true", help="change the input file; no output file is written")
    parser.add_argument(
        "--geom_inertia_role_order",
        nargs="+",
        choices=_ROLES,
        default=list(_ROLES),
        help="the first of these roles for which a link has geometry gives its inertia",
    )
    return parser


def _fixed(path: Path, roles: list[str]) -> bytes:
    from sheldrake.cad._xml_edit import XmlSource, apply
    from sheldrake.multibody.parsing import DiagnosticPolicy, PackageMap
    from sheldrake.multibody.parsing._parser import read_models
    from sheldrake.multibody.parsing._reading import Reading
    from sheldrake.multibody.parsing._xml import parse_xml

    kind = path.suffix.lower()
    if kind not in (".urdf", ".sdf"):
        raise RuntimeError(f"fix_inertia: '{path}' is neither a URDF nor an SDFormat file.")
    if not path.is_file():
        raise RuntimeError(f"fix_inertia: there is no file '{path}'.")
    policy, packages = DiagnosticPolicy(), PackageMap()
    packages.PopulateFromRosPackagePath()
    data = path.read_bytes()
    source = XmlSource(data, parse_xml(data, os.path.abspath(path), policy))
    folder = os.path.dirname(os.path.abspath(path))
    reading = Reading(policy, packages, os.path.abspath(path), folder, True, (os.path.realpath(path),))
    policy.SetActionForWarnings(lambda detail: None)  # of what is about to be put right
    edits: list[Any] = []
    waiting = list(read_models(kind, reading, None))
    while waiting:
        model = waiting.pop()
        waiting += model.nested
        for body in model.bodies:
            if not body.is_world and os.path.realpath(body.where.source) == os.path.realpath(path):
                edits += _edits(source, body, kind, roles)
    return apply(data, edits)


def _edits(source: Any, body: Any, kind: str, roles: list[str]) -> list[Any]:
    """The edits for a body whose inertia is impossible and that has geometry."""
    link = source.element_at(body.where)
    inertial = None if link is None else link.find("inertial")
    if inertial is None:
        return []
    mass, possible = (_of_urdf if kind == ".urdf" else _of_sdf)(inertial)
    if possible:
        return []
    found = _of_geometry(body, roles)
    if found is None:
        return []
    volume, p, unit = found
    wrong_mass = not 0.0 < mass < np.inf
    mass = _WATER * volume if wrong_mass else mass
    I = unit * (mass / volume)
    center = " ".join(f"{x:.9g}" for x in p + 0.0)
    if kind == ".urdf":
        moments = " ".join(f'{key}="{I[i, j]:.9g}"' for key, i, j in _MOMENTS)
        new = {"origin": f'<origin xyz="{center}" rpy="0 0 0"/>', "inertia": f"<inertia {moments}/>"}
        new |= {"mass": f'<mass value="{mass!r}"/>'} if wrong_mass else {}
    else:
        moments = "".join(f"<{key}>{I[i, j]:.9g}</{key}>" for key, i, j in _MOMENTS)
        new = {"pose": f"<pose>{center} 0 0 0</pose>", "inertia": f"<inertia>{moments}</inertia>"}
        new |= {"mass": f"<mass>{mass!r}</mass>"} if wrong_mass else {}
    edits = [source.replace(inertial.find(tag), text) for tag, text in new.items() if inertial.find(tag) is not None]
    missing = [text for tag, text in new.items() if inertial.find(tag) is None]
    return edits + ([source.append_to(inertial, "".join(f"      {text}\n" for text in missing))] if missing else [])


def _is_possible(mass: float, values: dict[str, float]) -> bool:
    from sheldrake.multibody.parsing._inertia import find_problem

    moments, products = [[values[k] for k in keys] for keys in (("ixx", "iyy", "izz"), ("ixy", "ixz", "iyz"))]
    finite = np.isfinite([mass, *moments, *products]).all()
    return bool(finite) and find_problem(mass, moments, products) is None


def _of_urdf(inertial: Any) -> tuple[float, bool]:
    """Mass, and whether mass and inertia can be."""
    mass, inertia = inertial.find("mass"), inertial.find("inertia")
    values = {key: float((inertia.get(key) if inertia is not None else None) or 0.0) for key, _, _ in _MOMENTS}
    number = float((mass.get("value") if mass is not None else None) or 0.0)
    return number, _is_possible(number, values)


def _of_sdf(inertial: Any) -> tuple[float, bool]:
    def number(element: Any, tag: str, default: float) -> float:
        child = None if element is None else element.find(tag)
        return default if child is None else float(child.text)

    inertia = inertial.find("inertia")
    values = {key: number(inertia, key, 1.0 if i == j else 0.0) for key, i, j in _MOMENTS}
    mass = number(inertial, "mass", 1.0)
    return mass, _is_possible(mass, values)


def _of_geometry(body: Any, roles: list[str]) -> tuple[float, np.ndarray, np.ndarray] | None:
    """Volume, centroid and inertia about it for unit density of the geometry in the first role that has some."""
    from sheldrake.cad._check_bodies import _mass_properties

    for role in roles:
        shapes = [g for g in [*body.collisions, *body.visuals] if getattr(g, role) is not None]
        volume, first, second = 0.0, np.zeros(3), np.zeros((3, 3))
        for geometry in shapes:
            found = _mass_properties(geometry.shape)
            if found is None:
                continue
            R, p = geometry.X_BG.rotation().matrix(), np.asarray(geometry.X_BG.translation())
            centre, inertia = R @ found.p_GoGcm + p, R @ found.I_GGcm @ R.T
            volume += found.volume
            first += found.volume * centre
            second += 0.5 * np.trace(inertia) * np.eye(3) - inertia + found.volume * np.outer(centre, centre)
        if volume > 0.0:
            centre = first / volume
            central = second - volume * np.outer(centre, centre)
            return volume, centre, np.trace(central) * np.eye(3) - central
    return None


if __name__ == "__main__":
    raise SystemExit(main())
