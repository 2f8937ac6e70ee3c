"""`sheldrake convert`: a robot description in another format.

Reads URDF, SDFormat, MJCF, model directives and OBJ; writes URDF, SDFormat or MJCF, by the ending of the second name.
Says what the written file leaves out; it loads to a plant of the same dynamics.

  sheldrake convert robot.xml robot.urdf
  sheldrake convert robot.urdf robot.xml     for MuJoCo
"""

from __future__ import annotations

import argparse
import sys

from sheldrake.cli._output import add_json, print_json


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declares what `sheldrake convert` takes."""
    parser.add_argument("source", metavar="SOURCE", help="file to read: .urdf, .sdf, .xml, .dmd.yaml, .obj")
    parser.add_argument("target", metavar="TARGET", help="file to write: .urdf, .sdf, or .xml for MJCF")
    parser.add_argument(
        "--obj-meshes", action="store_true", help="write STL, DAE and PLY meshes as OBJ beside the target, for Drake"
    )
    add_json(parser, "files, losses and notes")
    parser.add_argument("--strict", action="store_true", help="fail when the target leaves anything out")


def run(options: argparse.Namespace) -> int:
    """Converts the file; returns 1 when it can not be done, 3 when something is left out and --strict was given."""
    from sheldrake.cad import ConvertModel

    try:
        written = ConvertModel(options.source, options.target, obj_meshes=options.obj_meshes)
    except (OSError, RuntimeError, ValueError) as error:
        print(f"sheldrake convert: {error}", file=sys.stderr)
        return 1
    status = 3 if written.losses and options.strict else 0
    files = [str(path) for path in [written.path, *written.files]]
    if options.json:
        print_json({"files": files, "losses": written.losses, "notes": written.notes})
        return status
    for loss in written.losses:
        print(f"not written: {loss}", file=sys.stderr)
    for note in written.notes:
        print(note)
    print(f"wrote {', '.join(files)}")
    return status
