"""`sheldrake mesh2urdf`: a part from CAD becomes a robot description with units, mass and inertia that hold.

Reads STL, OBJ, PLY, DAE, glTF and 3MF. Says which unit it takes the file to be in and why, and asks when that is not
clear; closes and turns surfaces that need it; computes mass and inertia of the solid; writes visual and collision
geometry. What it writes loads in sheldrake and in Drake.

  sheldrake mesh2urdf part.stl --mass 0.77 -o part.urdf
  sheldrake mesh2urdf frame.stl cover.stl --density 1200 --units mm --hull -o housing.urdf
"""

from __future__ import annotations

import argparse
import functools
import os
import sys
from collections.abc import Callable
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from sheldrake.cad._make_urdf import MeshModel

from sheldrake.cli._output import add_json, reporting

_MESHES = (".stl", ".obj", ".ply", ".dae", ".gltf", ".glb", ".3mf")


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declares what `sheldrake mesh2urdf` takes."""
    parser.add_argument("meshes", nargs="+", metavar="MESH", help="mesh files; together they make one rigid body")
    amount = parser.add_mutually_exclusive_group()
    amount.add_argument("--density", type=float, metavar="KG/M3", help="of the material (default: 1000, water)")
    amount.add_argument("--mass", type=float, metavar="KG", help="of the whole body")
    parser.add_argument(
        "--units", default="auto", choices=("auto", "mm", "cm", "m", "in"), help="of the mesh files (default: auto)"
    )
    shape = parser.add_mutually_exclusive_group()
    shape.add_argument("--hull", action="store_true", help="collide with the convex hull of each solid")
    shape.add_argument("--decompose", action="store_true", help="collide with several convex pieces of each solid")
    parser.add_argument("--origin-at-com", action="store_true", help="link frame at the centre of mass")
    parser.add_argument("--preview", metavar="HTML", help="write a page with shapes, frame and centre of mass, too")
    parser.add_argument("--name", help="of robot and link (default: the output's)")
    add_json(parser, "files, units, mass, notes and warnings")
    parser.add_argument("-o", "--output", metavar="URDF", help="file to write (default: beside the first mesh)")


def run(options: argparse.Namespace) -> int:
    """Writes the description and says what was thought and done; returns the exit status."""
    import pathlib

    if options.output is None:
        options.output = str(pathlib.Path(options.meshes[0]).with_suffix(".urdf"))
    try:
        model = _asking(functools.partial(_make, options), options.units)
    except (OSError, ValueError) as error:
        print(f"sheldrake mesh2urdf: {error}", file=sys.stderr)
        return 1
    if model is None:
        return 2
    written = [str(path) for path in (model.path, *model.files, *([options.preview] if options.preview else []))]
    with reporting(options) as told:
        told |= {
            "files": written,
            "units": [belief.unit for belief in model.units],
            "mass": model.mass,
            "center_of_mass": [float(x) for x in model.p_BoBcm_B],
            "notes": model.notes,
            "warnings": model.warnings,
        }
        for note in model.notes:
            print(note)
        for warning in model.warnings:
            print(f"warning: {warning}", file=sys.stderr)
        print(f"wrote {', '.join(written)}")
    return 0


def part_of(file: str, folder: str | os.PathLike[str]) -> str:
    """Returns a file as it is; of a mesh file a description, written into a folder, and says what it took it to be.

    Raises:
        OSError: The mesh cannot be read or the description not written.
        ValueError: The mesh is no solid, or nobody says which unit it is in.
    """
    if not file.lower().endswith(_MESHES) or not os.path.isfile(file):
        return file
    from sheldrake.cad import MakeUrdfFromMesh

    os.makedirs(folder, exist_ok=True)
    output = os.path.join(folder, f"{os.path.splitext(os.path.basename(file))[0]}.urdf")
    model = _asking(lambda units: MakeUrdfFromMesh(file, units=units, output=output), "auto")
    if model is None:
        raise ValueError(f"say in which unit {file} is: `sheldrake mesh2urdf {file} --units mm` makes a model of it.")
    print("\n".join([*model.notes, *model.warnings]))
    return output


def _asking(make: Callable[[str], MeshModel], units: str) -> MeshModel | None:
    """What is made with these units, or with those that somebody answers where they are unclear; None without one."""
    from sheldrake.cad import UnitsUnsure

    try:
        return make(units)
    except UnitsUnsure as unsure:
        answer = _ask(unsure)
    return None if answer is None else make(answer)


def _make(options: argparse.Namespace, units: str) -> MeshModel:
    from sheldrake.cad import MakeUrdfFromMesh

    return MakeUrdfFromMesh(
        options.meshes,
        density=options.density,
        mass=options.mass,
        units=units,
        collision="hull" if options.hull else "decompose" if options.decompose else "mesh",
        output=options.output,
        name=options.name,
        origin_at_com=options.origin_at_com,
        preview=options.preview,
    )


def _ask(unsure: Any) -> str | None:
    """Puts the question; at a terminal, takes the answer."""
    print(unsure.question, file=sys.stderr)
    if not (sys.stdin.isatty() and sys.stderr.isatty()):
        return None
    known = ("mm", "cm", "m", "in")
    print(f"{', '.join(known)}: ", end="", file=sys.stderr, flush=True)
    answer = sys.stdin.readline().strip()
    if answer in known:
        return answer
    print(f"'{answer}' is no unit; nothing was written.", file=sys.stderr)
    return None
