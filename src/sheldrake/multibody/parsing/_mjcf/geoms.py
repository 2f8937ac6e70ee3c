"""MJCF geoms: shapes, mass, appearance.

Into the geometries of a `BodyDescription`; geoms with density add to the mass of their body.
"""

from __future__ import annotations

import os
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from sheldrake.geometry._shape_types import SHAPE_TYPES

from .._files.xml import Element
from .._model.description import GeometryDescription
from .._reading.inertia import solid_properties
from .._reading.reading import Reading, rotation_from_z
from .defaults import Compiler, read_pose

if TYPE_CHECKING:
    from sheldrake.geometry import Shape
    from sheldrake.math import RigidTransform
    from sheldrake.multibody.tree import SpatialInertia

    from .._model.description import BodyDescription

DENSITY = 1000.0  # [kg/m^3] MuJoCo's default
GREY = (0.5, 0.5, 0.5, 1.0)  # MuJoCo's default colour
LAST_VISIBLE_GROUP = 2  # MuJoCo's viewer shows groups 0 to 2
_KNOWN = (
    "name",
    "class",
    "type",
    "size",
    "fromto",
    "pos",
    "quat",
    "axisangle",
    "euler",
    "xyaxes",
    "zaxis",
    "mass",
    "density",
    "rgba",
    "material",
    "mesh",
    "friction",
    "contype",
    "conaffinity",
    "condim",
    "group",
)
_SILENT = ("priority", "solmix", "solref", "solimp", "margin", "gap", "user")
_MEASURED = {row.mjcf.type: (row, row.mjcf.factors) for row in SHAPE_TYPES.values() if row.mjcf is not None}


@dataclass
class MeshAsset:
    """A mesh file with its scale, shape (3,)."""

    path: str
    scale: np.ndarray


@dataclass
class Assets:
    """What `<asset>` declares, by name."""

    meshes: dict[str, MeshAsset]
    colours: dict[str, np.ndarray | None]


@dataclass
class MassElement:
    """A part of a body's mass: mass [kg], its centre in the body frame and its inertia about that centre."""

    mass: float
    p_BoScm_B: np.ndarray
    I_SScm_B: np.ndarray  # [kg m^2], shape (3, 3)


def read_mesh_asset(element: Element, assets: Assets, compiler: Compiler, reading: Reading) -> None:
    """Adds a `<mesh>`; without geometry in the plant the file is not looked for, except for its mass."""
    reading.warn_unknown(element, attributes=("name", "file", "scale", "class"), silent=("content_type", "inertia"))
    file = element.get("file")
    name = element.get("name") or (os.path.splitext(os.path.basename(file))[0] if file else "?")
    if not file:
        reading.warn(element, f"The mesh '{name}' has no file and is ignored.")
        return
    path = file
    if "://" not in file and not os.path.isabs(file):
        path = os.path.join("" if reading.folder else os.getcwd(), compiler.mesh_folder, file)
    path = reading.resolve(path, element.where_attribute("file"))
    assets.meshes[name] = MeshAsset(path, reading.vector(element, "scale", 3, np.ones(3)))


def read_material_asset(element: Element, assets: Assets, reading: Reading) -> None:
    """Adds a `<material>`: its colour."""
    name = reading.name(element, "<material>")
    silent = ("class", "specular", "shininess", "reflectance", "emission", "metallic", "roughness", "texrepeat")
    reading.warn_unknown(element, ("layer",), ("name", "rgba", "texture"), (*silent, "texuniform"))
    if "texture" in element.attributes:
        reading.warn(element, f"The texture of material '{name}' is ignored; textures are not supported.")
    assets.colours[name] = reading.vector(element, "rgba", 4)


def read_geom(
    element: Element,
    index: int,
    body: BodyDescription,
    assets: Assets,
    compiler: Compiler,
    reading: Reading,
    weighs: bool = True,
) -> MassElement | None:
    """Adds a geom (defaults filled in) to a body; returns its mass; None without one, or when nobody asks."""
    reading.warn_unknown(element, attributes=_KNOWN, silent=_SILENT)
    name = element.get("name") or f"geom{index}"
    placed = _read_shape(element, name, assets, compiler, reading)
    if placed is None:
        return None
    shape, X_BG = placed
    _add_roles(GeometryDescription(element.where, name, X_BG, shape), element, body, assets, reading)
    if body.is_world:
        return None
    return _read_mass(element, shape, X_BG, name, reading, weighs)


def _read_shape(
    element: Element, name: str, assets: Assets, compiler: Compiler, reading: Reading
) -> tuple[Shape, RigidTransform] | None:
    """(shape, X_BG), or None when the geom is ignored."""
    from sheldrake.geometry import HalfSpace, Mesh

    kind = element.get("type", "sphere")
    if "mesh" in element.attributes and kind != "mesh":
        reading.fail(element, f"Geom '{name}' of type {kind} has a mesh: fitting shapes to meshes is not supported.")
    X_BG = read_pose(element, compiler, reading)
    if kind == "plane":
        return HalfSpace(), X_BG
    if kind == "hfield":
        reading.warn(element, f"Geom '{name}' of type hfield is not supported and is ignored.")
        return None
    if kind == "mesh":
        if "mesh" not in element.attributes:
            reading.fail(element, f"Geom '{name}' of type mesh needs the attribute 'mesh', the name of an asset.")
        asset = assets.meshes.get(element.get("mesh", ""))
        if asset is None:
            known = ", ".join(assets.meshes) or "(none)"
            reading.warn(element, f"Geom '{name}' names the unknown mesh '{element.get('mesh')}'; known: {known}.")
            return None
        return Mesh(asset.path, asset.scale), X_BG
    if kind not in _MEASURED:
        known = ", ".join(("plane", "mesh", *_MEASURED))
        reading.fail(element, f"Geom '{name}' has the unknown type '{kind}'; known are {known}.")
    row, factors = _MEASURED[kind]
    text = element.get("size", "0" if row.may_be_empty else "")
    size = reading.parse_vector(text, None, element.where_attribute("size"), f"size of geom '{name}'")
    if "fromto" in element.attributes and len(factors) == 3:
        reading.warn(element, f"'fromto' is not supported for a {kind}; geom '{name}' is ignored.")
        return None
    if "fromto" in element.attributes:
        X_BG, half_length = _read_from_to(element, name, reading)
        size = np.array([size[0] if size.size else 0.0, half_length])
    if size.size < len(factors):
        reading.fail(element, f"The size of geom '{name}' ({kind}) needs {len(factors)} numbers, found {size.size}.")
    needed = size[: len(factors)]
    if np.any(needed < 0.0) or (not row.may_be_empty and np.any(needed == 0.0)):
        reading.fail(element, f"The size of geom '{name}' must be positive, found '{text}'.")
    if np.any(needed == 0.0):
        reading.warn(element, f"Geom '{name}' is a {kind} of radius zero.")
    return row.shape(*(needed / np.array(factors))), X_BG


def _read_from_to(element: Element, name: str, reading: Reading) -> tuple[RigidTransform, float]:
    """Pose and half length of a shape that stretches between two points."""
    from sheldrake.math import RigidTransform

    points = reading.vector(element, "fromto", 6)
    along = points[3:] - points[:3]
    length = float(np.linalg.norm(along))
    if length < 1e-12:
        reading.fail(element, f"The two points of 'fromto' of geom '{name}' coincide.")
    return RigidTransform(rotation_from_z(along), 0.5 * (points[:3] + points[3:])), 0.5 * length


def _add_roles(
    description: GeometryDescription, element: Element, body: BodyDescription, assets: Assets, reading: Reading
) -> None:
    """Registers the geom for drawing unless its group is hidden, and for contact unless both masks are zero."""
    from sheldrake.geometry import IllustrationProperties, PerceptionProperties, ProximityProperties, Rgba
    from sheldrake.multibody.plant import CoulombFriction

    name = description.name
    contype, conaffinity = (int(reading.number(element, key, 1)) for key in ("contype", "conaffinity"))
    mu = _read_friction(element, name, reading)
    condim = int(reading.number(element, "condim", 3))
    if condim != 3:
        reading.warn(element, f"Geom '{name}': condim {condim} is not supported; 3 is used.")
    if (contype, conaffinity) not in ((1, 1), (0, 0)):
        reading.warn(
            element,
            f"Geom '{name}': contype {contype} and conaffinity {conaffinity} are not supported; it touches everything.",
        )
    rgba = _read_colour(element, name, assets, reading)
    if not reading.wants_geometry:
        return
    if int(reading.number(element, "group", 0)) <= LAST_VISIBLE_GROUP:
        visual = GeometryDescription(description.where, name, description.X_BG, description.shape)
        visual.illustration, visual.perception = IllustrationProperties(), PerceptionProperties()
        for properties in (visual.illustration, visual.perception):
            properties.AddProperty("phong", "diffuse", Rgba(*rgba))
        body.visuals.append(visual)
        body.order.append(visual)
    if (contype, conaffinity) != (0, 0):
        description.proximity = ProximityProperties()
        description.proximity.AddProperty("material", "coulomb_friction", CoulombFriction(mu, mu))
        body.collisions.append(description)
        body.order.append(description)


def _read_friction(element: Element, name: str, reading: Reading) -> float:
    text = element.get("friction")
    if text is None:
        return 1.0
    where = element.where_attribute("friction")
    values = reading.parse_vector(text, None, where, "attribute 'friction'")
    if values.size == 0 or values[0] < 0.0:
        reading.fail(where, f"Geom '{name}': friction must not be negative or empty, found '{text}'.")
    if values.size > 1:
        reading.warn(where, f"Geom '{name}': torsional and rolling friction are not supported and are ignored.")
    return float(values[0])


def _read_colour(element: Element, name: str, assets: Assets, reading: Reading):
    colour = None
    material = element.get("material")
    if material is not None:
        if material not in assets.colours:
            reading.warn(element, f"Geom '{name}' names the unknown material '{material}'.")
        colour = assets.colours.get(material)
    rgba = reading.vector(element, "rgba", 4, colour)
    return GREY if rgba is None else np.clip(rgba, 0.0, 1.0)


def _read_mass(
    element: Element, shape: Shape, X_BG: RigidTransform, name: str, reading: Reading, weighs: bool
) -> MassElement | None:
    from sheldrake.geometry import HalfSpace, Sphere

    mass, density = reading.number(element, "mass"), reading.number(element, "density", DENSITY)
    if (mass is not None and mass < 0.0) or density < 0.0:
        reading.fail(element, f"Geom '{name}': mass and density must not be negative.")
    if not weighs or isinstance(shape, HalfSpace):  # a large mesh takes a tenth of a second to weigh
        return None
    if isinstance(shape, Sphere) and shape.radius() == 0.0:
        return MassElement(mass or 0.0, np.asarray(X_BG.translation()), np.zeros((3, 3)))
    volume, p_GoScm_G, I_SScm_G = solid_properties(shape, element, f"geom '{name}'", reading)
    mass = density * volume if mass is None else mass
    R_BG = X_BG.rotation().matrix()
    p_BoScm_B = np.asarray(X_BG @ np.asarray(p_GoScm_G, dtype=float)).reshape(3)
    return MassElement(mass, p_BoScm_B, mass / volume * R_BG @ I_SScm_G @ R_BG.T)


def sum_mass(parts: list[MassElement]) -> SpatialInertia:
    """The spatial inertia of a body about its origin, M_BBo_B, from its parts."""
    from sheldrake.multibody.tree import RotationalInertia, SpatialInertia

    mass = sum(part.mass for part in parts)
    if mass == 0.0:
        return SpatialInertia.Zero()
    p_BoBcm_B = sum(part.mass * part.p_BoScm_B for part in parts) / mass
    I_BBcm_B = np.zeros((3, 3))
    for part in parts:
        d = part.p_BoScm_B - p_BoBcm_B
        I_BBcm_B += part.I_SScm_B + part.mass * ((d @ d) * np.eye(3) - np.outer(d, d))
    moments, products = np.diag(I_BBcm_B), (I_BBcm_B[0, 1], I_BBcm_B[0, 2], I_BBcm_B[1, 2])
    return SpatialInertia.MakeFromCentralInertia(mass, p_BoBcm_B, RotationalInertia(*moments, *products))
