"""Repairs impossible inertias of URDF and SDFormat files with those of the geometry."""

from __future__ import annotations

import os
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from sheldrake.geometry import Role

if TYPE_CHECKING:
    from os import PathLike
    from xml.etree.ElementTree import Element

GEOM_INERTIA_ROLE_ORDER_DEFAULT = [Role.kProximity, Role.kIllustration, Role.kPerception]
_MASS = 1.0  # [kg] of a body whose mass is impossible, too, as Drake takes it
_MOMENTS = (("ixx", 0, 0), ("ixy", 0, 1), ("ixz", 0, 2), ("iyy", 1, 1), ("iyz", 1, 2), ("izz", 2, 2))
_ROLES = {Role.kProximity: "proximity", Role.kIllustration: "illustration", Role.kPerception: "perception"}


class InertiaFixer:
    """Writes a URDF or SDFormat file with inertias of the geometry in the place of impossible ones.

    Args:
        input_file: The file.
        output_file: Where to write; the standard output by default.
        in_place: Change the input file instead.
        geom_inertia_role_order: The first of these roles for which a link has geometry gives its inertia.
    """

    def __init__(
        self,
        *,
        input_file: str | PathLike[str],
        output_file: str | PathLike[str] | None = None,
        in_place: bool = False,
        geom_inertia_role_order: list[Role] = GEOM_INERTIA_ROLE_ORDER_DEFAULT,
    ):
        self._input, self._output, self._in_place = Path(input_file), output_file, in_place
        self._roles = [_ROLES[role] for role in geom_inertia_role_order]

    def fix_inertia(self) -> None:
        """Writes the file.

        Raises:
            RuntimeError: The input can not be read.
        """
        fixed = fixed_text(self._input, self._roles)
        output = self._input if self._in_place else self._output
        if output is None:
            sys.stdout.write(fixed.decode("utf-8", "replace"))
        else:
            Path(output).write_bytes(fixed)


def fixed_text(path: Path, roles: list[str]) -> bytes:
    """The file with inertias of the geometry in the place of impossible ones; roles by name, in order."""
    from sheldrake.cad._xml_edit import XmlSource, apply
    from sheldrake.multibody.parsing import DiagnosticPolicy, PackageMap
    from sheldrake.multibody.parsing._files.xml import parse_xml
    from sheldrake.multibody.parsing._parser import read_models
    from sheldrake.multibody.parsing._reading.reading import Reading

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
    mass = _MASS if wrong_mass else mass
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
    from sheldrake.multibody.parsing._reading.inertia import find_problem

    moments, products = [[values[k] for k in keys] for keys in (("ixx", "iyy", "izz"), ("ixy", "ixz", "iyz"))]
    finite = np.isfinite([mass, *moments, *products]).all()
    return bool(finite) and find_problem(mass, moments, products) is None


def _of_urdf(inertial: Element) -> tuple[float, bool]:
    """Mass, and whether mass and inertia can be."""
    mass, inertia = inertial.find("mass"), inertial.find("inertia")
    values = {key: float((inertia.get(key) if inertia is not None else None) or 0.0) for key, _, _ in _MOMENTS}
    number = float((mass.get("value") if mass is not None else None) or 0.0)
    return number, _is_possible(number, values)


def _of_sdf(inertial: Element) -> tuple[float, bool]:
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
