"""A mesh from CAD becomes a URDF: units, closed surfaces, mass and inertia, visual and collision geometry."""

from __future__ import annotations

import os
import re
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from ._mesh_files import check_folder
from ._plausible import why_impossible, why_odd_density, why_too_large
from ._preview import write_preview
from ._repair import Repaired, orient, repair
from ._solids import MeshFile, Solid, read_mesh_file
from ._units import UnitBelief, guess_units, size_text, stated_units
from ._xml_tree import MOMENTS, Node

if TYPE_CHECKING:
    from os import PathLike

    from sheldrake.geometry import PolygonSurfaceMesh
    from sheldrake.geometry._meshes.mass_properties import MassProperties

WATER = 1000.0  # [kg/m^3]
_NOTED_FILLING = 0.05  # of the volume


class UnitsUnsure(ValueError):
    """The unit of a mesh file is not clear enough to go on.

    Attributes:
        belief: What is known.
        question: The question to ask, with the size of the part for each unit.
    """

    def __init__(self, name: str, belief: UnitBelief):
        self.belief = belief
        self.question = belief.Question(name)
        super().__init__(self.question)


@dataclass
class MeshModel:
    """What `MakeUrdfFromMesh` made, and what it thought.

    Attributes:
        urdf: Text of the description.
        path: Where it was written, or None.
        files: Mesh files written beside it.
        units: For each mesh file, the unit it was taken to be in.
        solids: Names of the separate solids found.
        volume: [m^3].
        mass: [kg].
        p_BoBcm_B: Centre of mass in the link's frame [m], shape (3,).
        I_BBcm_B: Rotational inertia about the centre of mass [kg m^2], shape (3, 3).
        notes: What was found and done, for people.
        warnings: What somebody should look at.
    """

    urdf: str = ""
    path: Path | None = None
    files: list[Path] = field(default_factory=list)
    units: list[UnitBelief] = field(default_factory=list)
    solids: list[str] = field(default_factory=list)
    volume: float = 0.0
    mass: float = 0.0
    p_BoBcm_B: Any = None
    I_BBcm_B: Any = None
    notes: list[str] = field(default_factory=list)
    warnings: list[str] = field(default_factory=list)


def MakeUrdfFromMesh(
    mesh_files: Any,
    *,
    density: float | None = None,
    mass: float | None = None,
    units: str = "auto",
    collision: str = "mesh",
    output: str | PathLike[str] | None = None,
    name: str | None = None,
    origin_at_com: bool = False,
    preview: str | PathLike[str] | None = None,
) -> MeshModel:
    """A robot description of one rigid body made from mesh files, of uniform density.

    STL (text and binary), OBJ, PLY, DAE, glTF and 3MF are read. The link's frame is that of the files, so that parts
    exported from one assembly fit together; several files, and several solids in a file, make one body.

    Args:
        mesh_files: One path or several.
        density: [kg/m^3]; water's if neither density nor mass is given.
        mass: Of the whole body [kg].
        units: "auto", or what one number of the files is: "mm", "cm", "m", "in".
        collision: "mesh" (the surface itself; contact takes its convex hull), "hull" (one convex hull a solid), or
            "decompose" (several convex pieces a solid).
        output: The URDF to write; meshes that had to be changed are written beside it. None writes nothing, and then
            the text refers to the files as they are.
        name: Of the robot and its link; by default that of the output or of the first file.
        origin_at_com: Put the link's frame at the centre of mass instead, its axes as in the files.
        preview: An HTML page to write, too: shapes, frame and centre of mass, without a network; needs `output`.

    Raises:
        FileNotFoundError: A file is missing, or the folder of the output.
        UnitsUnsure: `units` is "auto" and the files do not settle it; it has the question to ask.
        ValueError: A file is damaged or no solid, or an argument has no meaning.
    """
    paths = [Path(p) for p in ([mesh_files] if isinstance(mesh_files, (str, os.PathLike)) else mesh_files)]
    _check_arguments(paths, density, mass, collision, needs_output=preview is not None and output is None)
    _check_output(output)
    meshes = [read_mesh_file(path) for path in paths]
    pieces = [[piece for solid in mesh.solids for piece in repair(solid)] for mesh in meshes]
    for group in pieces:
        orient(group)
    model = MeshModel()
    _settle_units(model, meshes, pieces, units, mass)
    _say_what_was_done(model, meshes, pieces)
    _set_mass(model, meshes, pieces, density, mass)
    output = None if output is None else Path(output)
    name = _xml_name(name or (output or paths[0]).stem)
    shift = -model.p_BoBcm_B if origin_at_com else np.zeros(3)
    geometry = _Geometry(model, meshes, pieces, output, shift, name)
    visuals = geometry.visuals()
    if collision == "mesh":
        _say_what_hulls_fill(model, meshes, pieces)
    collisions = visuals if collision == "mesh" else geometry.convex(collision == "decompose")
    model.p_BoBcm_B = model.p_BoBcm_B + shift
    model.urdf = _urdf(model, name, visuals, collisions, collision != "mesh")
    if output is not None:
        output.write_text(model.urdf, encoding="utf-8")
        model.path = output
    if preview is not None:
        write_preview(model, Path(preview))
    return model


def _check_arguments(
    paths: list[Path], density: float | None, mass: float | None, collision: str, needs_output: bool
) -> None:
    if not paths:
        raise ValueError("MakeUrdfFromMesh(): there is no mesh file.")
    if density is not None and mass is not None:
        raise ValueError("MakeUrdfFromMesh(): give the density or the mass, not both.")
    for what, value in (("density", density), ("mass", mass)):
        if value is not None and not 0.0 < value < np.inf:
            raise ValueError(f"MakeUrdfFromMesh(): the {what} must be positive and finite, not {value!r}.")
    if collision not in ("mesh", "hull", "decompose"):
        raise ValueError(f"MakeUrdfFromMesh(): collision is 'mesh', 'hull' or 'decompose', not {collision!r}.")
    if needs_output:
        raise ValueError("MakeUrdfFromMesh(): a preview needs an output.")


def _check_output(output: str | PathLike[str] | None) -> None:
    """Raises where a URDF does not belong, as in the place of the mesh."""
    if output is None:
        return
    if Path(output).suffix.lower() != ".urdf":
        raise ValueError(f"MakeUrdfFromMesh(): it writes a URDF, and '{output}' does not end with .urdf.")
    check_folder("MakeUrdfFromMesh()", Path(output))


def _settle_units(model: MeshModel, meshes: list[MeshFile], pieces: list, units: str, mass: float | None) -> None:
    for mesh, group in zip(meshes, pieces):
        if not group:
            raise ValueError(f"'{mesh.path}' encloses no volume: next to its size, its triangles are points and lines.")
        points = np.concatenate([piece.solid.vertices for piece in group])
        if units != "auto":
            belief = stated_units(units, np.ptp(points, axis=0))
        else:
            volume = sum(_numbers(piece).volume for piece in group)
            belief = guess_units(mesh, volume, mass if len(meshes) == 1 else None)
            if not belief.is_sure:
                raise UnitsUnsure(str(mesh.path), belief)
        model.units.append(belief)
        model.notes.append(f"units of {mesh.path.name}: {belief.Describe()}")
        if mesh.declared is not None and not np.isclose(mesh.declared, belief.metres, rtol=1e-6):
            model.warnings.append(
                f"{mesh.path.name} itself says otherwise ({mesh.declared_by}); it was read in {belief.unit}"
            )


def _say_what_was_done(model: MeshModel, meshes: list[MeshFile], pieces: list) -> None:
    for mesh, group in zip(meshes, pieces):
        solids = [piece for piece in group if not piece.is_cavity]
        model.solids += [piece.solid.name for piece in solids]
        if len(solids) > 1:
            names = ", ".join(piece.solid.name for piece in solids[:6]) + (", ..." if len(solids) > 6 else "")
            model.notes.append(f"{mesh.path.name} holds {len(solids)} separate solids ({names}); they make one body")
        if len(solids) < len(group):
            model.notes.append(f"{mesh.path.name} has {len(group) - len(solids)} hollow(s) inside; they weigh nothing")
        triangles = sum(len(piece.solid.triangles) for piece in group)
        if all(piece.is_closed for piece in group):
            repaired = ", after repair" if any(piece.done for piece in group) else ""
            model.notes.append(f"{mesh.path.name}: {triangles} triangles, watertight{repaired}")
        for piece in group:
            model.notes += [f"{mesh.path.name}: {text}" for text in piece.done]
            model.warnings += [f"{mesh.path.name}: {text}" for text in piece.warnings]
        _warn_of_overlap(model, solids)


def _warn_of_overlap(model: MeshModel, solids: list[Repaired]) -> None:
    """Solids that share space count that space twice; their boxes tell where that may be."""
    boxes = [(p.solid.vertices.min(axis=0), p.solid.vertices.max(axis=0), p) for p in solids[:50] if not p.warnings]
    for i, (low, high, first) in enumerate(boxes):
        for other_low, other_high, second in boxes[i + 1 :]:
            common = np.minimum(high, other_high) - np.maximum(low, other_low)
            if (common > 1e-6 * np.maximum(high - low, other_high - other_low)).all():
                model.notes.append(
                    f"the boxes of '{first.solid.name}' and '{second.solid.name}' overlap; where the solids do, "
                    "material counts twice"
                )


def _numbers(piece: Repaired) -> MassProperties:
    """Volume, centroid and inertia of a piece in its file's unit; of its convex hull when it is not closed."""
    from sheldrake.geometry._meshes.mass_properties import of_polygons, of_triangles

    if piece.is_closed:
        return of_triangles(piece.solid.vertices, piece.solid.triangles)
    return of_polygons(_hull(piece.solid))


def _hull(solid: Solid) -> PolygonSurfaceMesh:
    from sheldrake.geometry._meshes.convex_hull import make_convex_hull

    try:
        return make_convex_hull(solid.vertices, f"'{solid.name}'")
    except RuntimeError as error:
        raise ValueError(f"'{solid.name}' is no solid: {error}") from error


def _set_mass(
    model: MeshModel, meshes: list[MeshFile], pieces: list, density: float | None, mass: float | None
) -> None:
    volume, first, second = 0.0, np.zeros(3), np.zeros((3, 3))
    for belief, mesh, group in zip(model.units, meshes, pieces):
        size = float(np.max(belief.size)) * belief.metres
        for piece in group:
            if not piece.is_closed:
                model.warnings.append(
                    f"{mesh.path.name}: mass and inertia of '{piece.solid.name}' are its convex hull's"
                )
            found, k = _numbers(piece), belief.metres
            part = found.volume * k**3
            centre = found.p_GoGcm * k
            moments = found.I_GGcm * k**5
            volume += part
            first += part * centre
            second += 0.5 * np.trace(moments) * np.eye(3) - moments + part * np.outer(centre, centre)
        if volume <= 1e-9 * size**3:
            raise ValueError(
                f"'{mesh.path}' encloses no volume ({volume:.3g} m^3 in {size_text(belief.size * belief.metres)}): it "
                "is a surface, not a solid. Give it a thickness in CAD."
            )
    model.volume = volume
    if mass is None and density is None:
        density = WATER
        model.notes.append(f"neither density nor mass was given: {WATER:g} kg/m^3, as water")
    model.mass = density * volume if mass is None else mass  # type: ignore[operator]
    model.p_BoBcm_B = _without_rounding(first / volume, volume ** (1 / 3))
    central = second - volume * np.outer(model.p_BoBcm_B, model.p_BoBcm_B)
    inertia = (np.trace(central) * np.eye(3) - central) * (model.mass / volume)
    model.I_BBcm_B = _without_rounding(inertia, float(np.trace(inertia)))
    _check_mass(model, pieces)


def _say_what_hulls_fill(model: MeshModel, meshes: list[MeshFile], pieces: list) -> None:
    """Contact takes the convex hull of a mesh: people with holes and hollows in their parts want to know."""
    from sheldrake.geometry._meshes.convex_hull import make_convex_hull
    from sheldrake.geometry._meshes.mass_properties import of_polygons

    filled = -model.volume
    for belief, mesh, group in zip(model.units, meshes, pieces):
        vertices = np.concatenate([piece.solid.vertices for piece in group])
        filled += of_polygons(make_convex_hull(vertices, f"'{mesh.path.name}'")).volume * belief.metres**3
    if filled > _NOTED_FILLING * model.volume:
        model.notes.append(
            f"in contact the part is its convex hull, {100.0 * filled / model.volume:.0f} % larger: holes and hollows "
            "are filled; --decompose (collision='decompose') keeps them"
        )


def _without_rounding(values: np.ndarray, scale: float) -> np.ndarray:
    """Zero for what is zero but for rounding: a file for people says so."""
    return np.where(np.abs(values) < 1e-13 * abs(scale), 0.0, values)


def _check_mass(model: MeshModel, pieces: list) -> None:
    least = 1e-9 * model.volume ** (1 / 3)  # [m] less is rounding
    centre = ", ".join(f"{x if abs(x) > least else 0.0:.4g}" for x in model.p_BoBcm_B)
    model.notes.append(
        f"volume {model.volume:.6g} m^3, mass {model.mass:.6g} kg ({model.mass / model.volume:.4g} kg/m^3), centre of "
        f"mass ({centre}) m"
    )
    points = np.concatenate(
        [piece.solid.vertices * belief.metres for belief, group in zip(model.units, pieces) for piece in group]
    )
    farthest = float(np.linalg.norm(points - model.p_BoBcm_B, axis=1).max())
    for problem in (
        why_impossible(model.mass, model.I_BBcm_B),
        why_too_large(model.mass, model.I_BBcm_B, farthest),
        why_odd_density(model.mass, model.volume),
    ):
        if problem is not None:
            model.warnings.append(problem)


class _Geometry:
    """Mesh files that the URDF refers to: as they came where that is possible, else written anew, in metres."""

    def __init__(self, model, meshes, pieces, output, shift, name):
        self._model, self._meshes, self._pieces = model, meshes, pieces
        self._folder = None if output is None else output.parent
        self._shift, self._name = shift, name
        self._taken = {mesh.path.resolve() for mesh in meshes}

    def visuals(self) -> list[tuple[str, float]]:
        """File name in the URDF and scale of each mesh."""
        found = []
        for mesh, belief, group in zip(self._meshes, self._model.units, self._pieces):
            as_it_is = mesh.path.suffix.lower() == ".obj" and mesh.is_plain and not self._shift.any()
            if as_it_is and not any(piece.is_changed for piece in group):
                found.append((self._relative(mesh.path), belief.metres))
                continue
            solids = [(piece.solid.vertices * belief.metres + self._shift, piece.solid.triangles) for piece in group]
            found.append((self._write(mesh.path.stem, solids, mesh.path), 1.0))
        return found

    def convex(self, several: bool) -> list[tuple[str, float]]:
        """The same for convex pieces."""
        found = []
        for mesh, belief, group in zip(self._meshes, self._model.units, self._pieces):
            number = 0
            for piece in group:
                if piece.is_cavity:
                    continue
                for hull in self._hulls(piece, several, mesh.path.name):
                    number += 1
                    polygons = _polygons(hull)
                    vertices = hull._vertices * belief.metres + self._shift
                    stem = f"{mesh.path.stem}_hull" + (f"_{number}" if number > 1 else "")
                    found.append((self._write(stem, [(vertices, polygons)], mesh.path), 1.0))
        return found

    def _hulls(self, piece: Repaired, several: bool, file: str) -> list[Any]:
        if not several or not piece.is_closed:
            return [_hull(piece.solid)]
        from ._decompose import decompose

        hulls, error = decompose(piece.solid)
        self._model.notes.append(
            f"{file}: '{piece.solid.name}' became {len(hulls)} convex pieces, {100.0 * error:.1f} % larger together"
        )
        return hulls

    def _relative(self, path: Path) -> str:
        if self._folder is None:
            return str(path)
        return Path(os.path.relpath(path.resolve(), self._folder.resolve())).as_posix()

    def _write(self, stem: str, solids: list, source: Path) -> str:
        """Writes an OBJ in metres beside the URDF and returns its name there."""
        if self._folder is None:
            self._model.notes.append(f"nothing was written: {stem}.obj is only named in the text")
            return f"{stem}.obj"
        path = self._folder / f"{stem}.obj"
        number = 1
        while path.resolve() in self._taken:
            number += 1
            path = self._folder / f"{stem}_{number}.obj"
        self._taken.add(path.resolve())
        write_obj(path, solids, f"made from {source.name}; metres")
        self._model.files.append(path)
        return path.name


def _polygons(hull: PolygonSurfaceMesh) -> list[list[int]]:
    return [list(face) for face in hull._faces]


def write_obj(path: Path, solids: list, comment: str) -> None:
    """Writes surfaces (vertices [m], polygons of vertex numbers from 0) to an OBJ file, numbers in full precision."""
    with open(path, "w", encoding="utf-8", newline="\n") as file:
        file.write(f"# {comment}\n")
        offset = 1
        for number, (vertices, polygons) in enumerate(solids, 1):
            file.write(f"g solid{number}\n")
            file.writelines("v {!r} {!r} {!r}\n".format(*vertex) for vertex in np.asarray(vertices).tolist())
            for polygon in polygons:
                file.write("f " + " ".join(str(int(v) + offset) for v in polygon) + "\n")
            offset += len(vertices)


def _xml_name(text: str) -> str:
    """A name without blanks and signs that other programs stumble over."""
    return re.sub(r"[^\w.-]+", "_", text).strip("_") or "part"


def _urdf(model: MeshModel, name: str, visuals: list, collisions: list, convex: bool) -> str:
    prefix = {"xmlns:drake": "https://drake.mit.edu"} if convex else {}
    robot = Node("robot", **prefix, name=name)
    link = robot.add("link", name=name)
    inertial = link.add("inertial")
    inertial.add("origin", xyz=model.p_BoBcm_B, rpy="0 0 0")
    inertial.add("mass", value=model.mass)
    inertial.add("inertia", **{key: model.I_BBcm_B[i, j] for key, i, j in MOMENTS})
    for tag, files in (("visual", visuals), ("collision", collisions)):
        for file, scale in files:
            geometry = link.add(tag).add("geometry")
            mesh = geometry.add("mesh", filename=file, scale=None if scale == 1.0 else [scale] * 3)
            if tag == "collision" and convex:
                mesh.add("drake:declare_convex")
    return robot.document()
