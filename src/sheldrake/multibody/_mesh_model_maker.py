"""Makes an SDFormat model of one body from a mesh file."""

from __future__ import annotations

import logging
import re
from pathlib import Path
from typing import TYPE_CHECKING
from xml.sax.saxutils import escape, quoteattr

import numpy as np

if TYPE_CHECKING:
    from collections.abc import Iterable
    from os import PathLike

    from numpy.typing import ArrayLike

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


class MeshModelMaker:
    """Writes a model made of a mesh file, and tells the `drake` logger what it is.

    Args:
        mesh_path: An OBJ file.
        output_dir: Existing folder for the model; by default the mesh's.
        scale: Metres per unit of the mesh.
        model_name: Of model and body; by default the mesh file's.
        density: Of the body [kg/m^3], unless `mass` is given.
        mass: Of the body [kg].
        at_com: Put the body's origin at the centre of mass.
        p_GoBo: Where else it is, in the frame of the mesh [m], shape (3,).
        encoded_package: How the model names the mesh: "none" (by file name), "auto" (in the package of the mesh's
            folder, which is made if need be), or the path of a package.xml above the mesh.

    Raises:
        ValueError: The output folder does not exist.
    """

    def __init__(
        self,
        *,
        mesh_path: str | PathLike[str],
        output_dir: str | PathLike[str] | None = None,
        scale: float = 1.0,
        model_name: str | None = None,
        density: float = _WATER,
        mass: float | None = None,
        at_com: bool = False,
        p_GoBo: ArrayLike | None = None,
        encoded_package: str = "none",
    ):
        self._mesh_path = Path(mesh_path)
        self._folder = self._mesh_path.parent if output_dir is None else Path(output_dir)
        if not self._folder.is_dir():
            raise ValueError(f"mesh_to_model: the output folder '{self._folder}' does not exist.")
        self._scale, self._name = scale, model_name or self._mesh_path.stem
        self._density, self._mass = density, mass
        self._at_com, self._p_GoBo = at_com, p_GoBo
        self._package = encoded_package

    def make_model(self) -> None:
        """Writes the model, named as the mesh file, with ending .sdf.

        Raises:
            ValueError: The scale or the package has no meaning.
            RuntimeError: The mesh can not be read or has no volume, or the mass is impossible.
        """
        from sheldrake.geometry import ReadObjToTriangleSurfaceMesh
        from sheldrake.geometry._meshes.mass_properties import of_triangles

        _LOG.info("Making a model of %s", self._mesh_path)
        uri = _uri(self._mesh_path, self._package)
        if not self._scale > 0.0:
            raise ValueError(f"mesh_to_model: the scale must be positive, got {self._scale}.")
        mesh = ReadObjToTriangleSurfaceMesh(self._mesh_path, self._scale)
        found = of_triangles(mesh._vertices, mesh._triangles)
        if not found.volume > 0.0:
            raise RuntimeError(
                f"mesh_to_model: '{self._mesh_path}' encloses {found.volume:g} m^3; it must be a closed surface."
            )
        mass = self._density * found.volume if self._mass is None else self._mass
        if not 0.0 < mass < np.inf:
            raise RuntimeError(f"mesh_to_model: the mass must be positive and finite, got {mass:g} kg.")
        p_GoBo = found.p_GoGcm if self._at_com else self._p_GoBo
        p_GoBo = np.zeros(3) if p_GoBo is None else np.asarray(p_GoBo, dtype=float)
        p_BoBcm = found.p_GoGcm - p_GoBo
        low, high = mesh._vertices.min(axis=0), mesh._vertices.max(axis=0)
        _LOG.info("    bounding box: %s m", " x ".join(f"{x:g}" for x in high - low))
        _LOG.info("    mass: %s kg, centre of mass in the body: %s m", mass, p_BoBcm.tolist())
        inertia = found.I_GGcm * (mass / found.volume)
        text = _text(self._name, float(mass), p_BoBcm, inertia, -p_GoBo, uri, self._scale)
        (self._folder / f"{self._mesh_path.stem}.sdf").write_text(text, encoding="utf-8")


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


def _words(values: Iterable[float]) -> str:
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
