"""A mesh file as an SDFormat model of one body.

    python -m sheldrake.multibody.mesh_to_model part.obj --scale 0.001

Takes the words of Drake's tool of this name: the mesh is in metres unless `--scale` says otherwise, nothing is
repaired, and the result lies beside the mesh. `sheldrake mesh2urdf` finds the unit itself, repairs, and writes URDF.
"""

from __future__ import annotations

import argparse

import numpy as np

from ._mesh_model_maker import MeshModelMaker


def main(argv: list[str] | None = None) -> int:
    """Runs the tool on the words of a command line; by default the process's own.

    Returns:
        The exit status, 0.

    Raises:
        SystemExit: The words make no sense.
        ValueError: An option has no meaning.
        RuntimeError: The mesh can not be read or has no volume, or the mass is impossible.
    """
    options = vars(_parser().parse_args(argv))
    amount = {name: options.pop(name) for name in ("density", "mass")}
    MeshModelMaker(**options, **{name: value for name, value in amount.items() if value is not None}).make_model()
    return 0


def _parser() -> argparse.ArgumentParser:
    assert __doc__ is not None
    formatter = argparse.RawDescriptionHelpFormatter
    parser = argparse.ArgumentParser(prog="mesh_to_model", description=__doc__, formatter_class=formatter)
    add = parser.add_argument
    add("mesh_path", help="the mesh file")
    add("--model-name", metavar="NAME", help="of model and body (default: the mesh file's)")
    add("--scale", metavar="FACTOR", type=float, default=1.0, help="metres per unit of the mesh (default: 1)")
    amount = parser.add_mutually_exclusive_group()
    amount.add_argument("--density", metavar="KG/M3", type=float, help="of the material (default: 1000, water)")
    amount.add_argument("--mass", metavar="KG", type=float, help="of the body")
    origin = parser.add_mutually_exclusive_group()
    origin.add_argument("--origin-at-com", dest="at_com", action="store_true", help="body frame at the centre of mass")
    origin.add_argument(
        "--body-origin",
        metavar="X,Y,Z",
        dest="p_GoBo",
        type=_triple,
        help="origin of the body frame in the mesh's frame [m]",
    )
    add(
        "--package",
        metavar="ENCODING",
        dest="encoded_package",
        default="none",
        help="how the model names the mesh: 'none' (by file name), 'auto' (in the package of the mesh's folder, which "
        "is made if need be), or the path of a package.xml above the mesh",
    )
    add("--output-dir", metavar="OUTPUT_DIR", help="existing folder for the model (default: the mesh's)")
    return parser


def _triple(text: str) -> np.ndarray:
    values = np.array([float(word) for word in text.split(",")])
    if values.shape != (3,):
        raise argparse.ArgumentTypeError(f"expected three numbers with commas between them, got {text!r}")
    return values


if __name__ == "__main__":
    raise SystemExit(main())
