"""A mesh file as an SDFormat model of one body.

    python -m sheldrake.multibody.mesh_to_model part.obj --scale 0.001

Takes the words of Drake's tool of this name: the mesh is in metres unless `--scale` says otherwise, nothing is
repaired, and the result lies beside the mesh. `sheldrake mesh2urdf` finds the unit itself, repairs, and writes URDF.
"""

from __future__ import annotations

import argparse
import logging
import re
from pathlib import Path
from typing import Any
from xml.sax.saxutils import escape, quoteattr

import numpy as np

_LOG = logging.getLogger("drake")
_WATER = 1000.0  # [kg/m^3]

_PACKAGE = """\
<?xml version="1.0"?>
<package format="2">
  <name>{name}</name>
  <version>0.0.0</version>
  <description>The folder of {mesh}.</description>
  <maintainer email="nobody@example.com">Nobody</maintainer>
  <license>unknown</license>
</package>
"""

_MODEL = """\
<?xml version='1.0'?>
<sdf xmlns:drake="http://drake.mit.edu" version="1.8">
  <model name={name}>
    <link name={name}>
      <inertial>
        <pose>{center} 0 0 0</pose>
        <mass>{mass!r}</mass>
        <inertia>
{moments}
        </inertia>
      </inertial>
      <visual name='visual'>
{shape}
      </visual>
      <collision name='collision'>
{shape}
        <!-- Contact by pressure fields is asked for here; without drake:rigid_hydroelastic it is by points. -->
        <drake:proximity_properties>
          <drake:mu_dynamic>0.5</drake:mu_dynamic>
          <drake:mu_static>0.5</drake:mu_static>
          <drake:rigid_hydroelastic/>
        </drake:proximity_properties>
      </collision>
    </link>
  </model>
</sdf>
"""


def main(argv: list[str] | None = None) -> int:
    """Runs the tool on the words of a command line; by default the process's own.

    Returns:
        The exit status, 0.

    Raises:
        SystemExit: The words make no sense.
        ValueError: An option has no meaning.
        RuntimeError: The mesh can not be read or has no volume.
    """
    _make_model(_parser().parse_args(argv))
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
    origin.add_argument("--origin-at-com", action="store_true", help="body frame at the centre of mass")
    origin.add_argument(
        "--body-origin", metavar="X,Y,Z", type=_triple, help="origin of the body frame in the mesh's frame [m]"
    )
    add(
        "--package",
        metavar="ENCODING",
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


def _make_model(options: Any) -> None:
    from sheldrake.geometry import ReadObjToTriangleSurfaceMesh
    from sheldrake.geometry._mass_properties import of_triangles

    mesh_path = Path(options.mesh_path)
    folder = mesh_path.parent if options.output_dir is None else Path(options.output_dir)
    if not folder.is_dir():
        raise ValueError(f"mesh_to_model: the output folder '{folder}' does not exist.")
    _LOG.info("Making a model of %s", mesh_path)
    if not options.scale > 0.0:
        raise ValueError(f"mesh_to_model: the scale must be positive, got {options.scale}.")
    mesh = ReadObjToTriangleSurfaceMesh(mesh_path, options.scale)
    found = of_triangles(mesh._vertices, mesh._triangles)
    if not found.volume > 0.0:
        raise RuntimeError(f"mesh_to_model: '{mesh_path}' encloses {found.volume:g} m^3; it must be a closed surface.")
    mass = options.mass
    if mass is None:
        mass = (_WATER if options.density is None else options.density) * found.volume
    if not 0.0 < mass < np.inf:
        raise ValueError(f"mesh_to_model: the mass must be positive and finite, got {mass:g} kg.")
    uri = _uri(mesh_path, options.package)
    p_GoBo = found.p_GoGcm if options.origin_at_com else options.body_origin
    p_GoBo = np.zeros(3) if p_GoBo is None else p_GoBo
    p_BoBcm = found.p_GoGcm - p_GoBo
    low, high = mesh._vertices.min(axis=0), mesh._vertices.max(axis=0)
    _LOG.info("    bounding box: %s m", " x ".join(f"{x:g}" for x in high - low))
    _LOG.info("    mass: %s kg, centre of mass in the body: %s m", mass, p_BoBcm.tolist())
    name = options.model_name or mesh_path.stem
    text = _text(name, float(mass), p_BoBcm, found.I_GGcm * (mass / found.volume), -p_GoBo, uri, options.scale)
    (folder / f"{mesh_path.stem}.sdf").write_text(text, encoding="utf-8")


def _text(name: str, mass: float, p_BoBcm, I_BBcm, p_BoGo, uri: str, scale: float) -> str:
    moments = "\n".join(
        f"          <{tag}>{float(I_BBcm[i, j])!r}</{tag}>"
        for tag, i, j in (("ixx", 0, 0), ("ixy", 0, 1), ("ixz", 0, 2), ("iyy", 1, 1), ("iyz", 1, 2), ("izz", 2, 2))
    )
    shape = "\n".join(
        [
            f"        <pose>{_words(p_BoGo + 0.0)} 0 0 0</pose>",
            "        <geometry>",
            "          <mesh>",
            f"            <uri>{escape(uri)}</uri>",
            f"            <scale>{_words([scale] * 3)}</scale>",
            "          </mesh>",
            "        </geometry>",
        ]
    )
    return _MODEL.format(name=quoteattr(name), center=_words(p_BoBcm), mass=mass, moments=moments, shape=shape)


def _words(values: Any) -> str:
    return " ".join(repr(float(value)) for value in values)


def _uri(mesh_path: Path, package: str) -> str:
    """How the model names the mesh."""
    if package == "none":
        return mesh_path.name
    if package == "auto":
        file = mesh_path.resolve().parent / "package.xml"
        if not file.exists():
            text = _PACKAGE.format(name=escape(file.parent.name), mesh=escape(mesh_path.name))
            file.write_text(text, encoding="utf-8")
    else:
        file = Path(package).resolve()
        if file.name != "package.xml":
            raise ValueError(f"mesh_to_model: the package is 'none', 'auto' or a package.xml, not '{package}'.")
        if not file.is_file():
            raise ValueError(f"mesh_to_model: there is no file '{package}'.")
    try:
        inside = mesh_path.resolve().relative_to(file.parent)
    except ValueError:
        raise ValueError(f"mesh_to_model: the mesh '{mesh_path}' is not below the package '{file.parent}'.") from None
    return f"package://{_package_name(file)}/{inside.as_posix()}"


def _package_name(file: Path) -> str:
    found = re.search(r"<name>\s*([^<\s]+)\s*</name>", file.read_text(encoding="utf-8"))
    if found is None:
        raise ValueError(f"mesh_to_model: '{file}' does not say the name of its package.")
    return found[1]


if __name__ == "__main__":
    raise SystemExit(main())
