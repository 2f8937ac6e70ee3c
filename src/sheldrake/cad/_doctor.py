"""Finds the faults of a robot description: scale, inertia, meshes, overlaps, limits, names; and mends what it can."""

from __future__ import annotations

import os
from pathlib import Path
from typing import TYPE_CHECKING, Any
from xml.sax.saxutils import quoteattr

import numpy as np

from sheldrake.geometry import Convex, Mesh

from ._check_bodies import BodyFault, Solids, check_inertia, is_odd_size, solids_of
from ._check_urdf import UrdfText
from ._findings import Diagnosis, Finding
from ._xml_edit import Edit, XmlSource, apply, walk
from ._xml_tree import MOMENTS

if TYPE_CHECKING:
    from os import PathLike

    from sheldrake.multibody.parsing import PackageMap
    from sheldrake.multibody.parsing._files.diagnostics import DiagnosticPolicy
    from sheldrake.multibody.parsing._files.xml import Element
    from sheldrake.multibody.parsing._model.description import BodyDescription, GeometryDescription, ModelDescription
    from sheldrake.multibody.parsing._reading.reading import Reading

_TOUCHING = 1e-3  # [m] parts of an assembly that overlap less than this were meant to touch
_ENDINGS = (".urdf", ".sdf", ".xml")


def DiagnoseModel(path: str | PathLike[str], package_map: PackageMap | None = None) -> Diagnosis:
    """Everything that is wrong, or looks wrong, with a robot description.

    Args:
        path: URDF, SDFormat or MJCF.
        package_map: Where `package://` addresses lead (a PackageMap).

    Raises:
        FileNotFoundError: There is no such file.
        ValueError: It is no description of these kinds.
    """
    path = Path(path)
    if not path.is_file():
        raise FileNotFoundError(f"DiagnoseModel(): there is no file '{path}'.")
    if path.suffix.lower() not in _ENDINGS:
        raise ValueError(
            f"DiagnoseModel(): '{path}' is none of {', '.join(_ENDINGS)}; "
            "of a part from CAD `sheldrake mesh2urdf` makes a model."
        )
    return _Doctor(path, package_map).examine()


class _Doctor:
    def __init__(self, path: Path, package_map: PackageMap | None):
        from sheldrake.multibody.parsing import PackageMap

        self._path = path
        self._packages = PackageMap() if package_map is None else package_map
        self._data = path.read_bytes()
        self._diagnosis = Diagnosis(path, _data=self._data)
        self._source: XmlSource | None = None
        self._text: str | None = None  # the file with grave faults mended, when it has some

    def examine(self) -> Diagnosis:
        """Text first, so that one fault does not hide the others; then bodies; then the robot at rest."""
        if self._read_xml():
            if self._path.suffix.lower() == ".urdf":
                self._examine_text()
            models = self._read_models()
            for model in models:
                self._examine_model(model)
            if models:
                self._examine_rest()
        self._diagnosis.sort()
        return self._diagnosis

    def _add(self, severity: str, code: str, subject: str, message: str, where: Any, fix: str = "", edits=()) -> None:
        source = getattr(where, "source", str(self._path))
        source = str(self._path) if os.path.realpath(source) == os.path.realpath(self._path) else source
        line, column = getattr(where, "line", 0), getattr(where, "column", 0)
        finding = Finding(severity, code, subject, message, source, line, column, fix, list(edits))
        if finding not in self._diagnosis.findings:
            self._diagnosis.findings.append(finding)

    def _policy(self, note_warnings: bool = False) -> DiagnosticPolicy:
        from sheldrake.multibody.parsing import DiagnosticPolicy

        policy = DiagnosticPolicy()

        def note(detail: Any) -> None:
            if note_warnings and "inertia is impossible" not in detail.message:
                self._add("note", "parser", "", detail.message, detail.location)

        policy.SetActionForWarnings(note)
        return policy

    def _read_xml(self) -> bool:
        from sheldrake.multibody.parsing._files.xml import parse_xml

        try:
            root = parse_xml(self._data, str(self._path), self._policy())
        except RuntimeError as error:
            self._fail(error)
            return False
        self._source = XmlSource(self._data, root)
        return True

    def _fail(self, error: Any) -> None:
        message = getattr(error, "problem", str(error))
        self._add("error", "unreadable", "", message, getattr(error, "location", None))

    def _examine_text(self) -> None:
        from sheldrake.multibody.parsing._files.package_map import resolve_uri

        folder = str(self._path.resolve().parent)

        def resolve(name: str, where: Any) -> str:
            return resolve_uri(name.strip(), self._packages, folder, where, self._policy())

        assert self._source is not None
        found = UrdfText(self._source, self._path, resolve).check()
        for finding in found:
            finding.file = str(self._path)
        self._diagnosis.findings += found
        edits = [edit for finding in found if finding.severity == "error" for edit in finding.edits]
        if edits:
            # Edits keep the lines below where they are: they put no line breaks in, and take none out but of a mesh.
            self._text = apply(self._data, [_same_lines(self._data, edit) for edit in edits]).decode("utf-8", "replace")

    def _reading(self) -> Reading:
        from sheldrake.multibody.parsing._reading.reading import Reading

        path = os.path.abspath(self._path)
        policy = self._policy(note_warnings=True)
        return Reading(policy, self._packages, path, os.path.dirname(path), True, (os.path.realpath(path),))

    def _read_models(self) -> list[Any]:
        from sheldrake.multibody.parsing._parser import read_models

        try:
            return read_models(self._path.suffix.lower(), self._reading(), self._text)
        except (RuntimeError, NotImplementedError) as error:
            place = getattr(error, "location", None)
            known = [f for f in self._diagnosis.errors() if place is not None and f.line == place.line]
            if not known:
                self._fail(error)
            return []

    def _examine_model(self, model: ModelDescription) -> None:
        for nested in model.nested:
            self._examine_model(nested)
        still = _standing_still(model)
        for body in model.bodies:
            if not body.is_world:
                self._examine_body(body, body.name in still)

    def _examine_body(self, body: BodyDescription, stands_still: bool) -> None:
        solids = solids_of(body)
        element = self._element(body)
        mass, p_BoBcm, I_BBcm = _written(element) or _of_description(body)
        if solids is not None and is_odd_size(solids.points) and self._examine_scale(body, mass):
            return  # nothing else can be judged
        for fault in check_inertia(body.name, mass, p_BoBcm, I_BBcm, solids):
            if stands_still:
                fault = fault._replace(severity="note", message=fault.message + "; it never moves")
            self._report(body, element, fault, mass, solids)
        if mass == 0.0 and solids is not None and not np.any(I_BBcm):
            severity, end = ("note", "") if stands_still else ("warning", ": it moves without inertia")
            fault = BodyFault(severity, "mass-zero", f"'{body.name}' has geometry and no mass{end}", False)
            self._report(body, element, fault, mass, solids)

    def _report(
        self, body: BodyDescription, element: Element | None, fault: BodyFault, mass: float, solids: Solids | None
    ) -> None:
        fix, edits, place = fault.fix, [], body.where
        inertial = None if element is None else element.find("inertial")
        if inertial is not None:
            place = inertial.where
        if fault.new_inertia and mass > 0.0 and solids is not None and solids.I_BBcm is not None:
            fix = f"inertia and centre of mass of its geometry at {mass:g} kg: moments " + ", ".join(
                f"{x:.4g}" for x in np.diag(solids.I_BBcm) * mass
            )
            if element is not None and self._source is not None:
                edits = [self._new_inertial(element, inertial, mass, solids)]
        self._add(fault.severity, fault.code, body.name, fault.message, place, fix, edits)

    def _element(self, body: BodyDescription) -> Element | None:
        """The element of a body in the file itself, or None for an included one or another format."""
        if self._source is None or os.path.realpath(body.where.source) != os.path.realpath(self._path):
            return None
        element = self._source.element_at(body.where)
        return element if element is not None and element.tag == "link" else None

    def _new_inertial(self, link: Element, inertial: Element | None, mass: float, solids: Solids) -> Edit:
        assert self._source is not None and solids.p_BoBcm is not None and solids.I_BBcm is not None
        is_urdf = self._path.suffix.lower() == ".urdf"
        text = (_urdf_inertial if is_urdf else _sdf_inertial)(mass, solids.p_BoBcm, solids.I_BBcm * mass)
        if inertial is None:
            return self._source.append_to(link, f"    {text}\n")
        return self._source.replace(inertial, text)

    def _examine_scale(self, body: BodyDescription, mass: float) -> bool:
        """Reports geometry of an absurd size; says whether there is some."""
        meshes = {}
        for geometry in [*body.collisions, *body.visuals]:
            shape = geometry.shape
            if isinstance(shape, (Mesh, Convex)) and shape.source().is_path():
                meshes[shape.source().path(), tuple(shape.scale3())] = geometry
        found = False
        for (path, scale), geometry in meshes.items():
            found |= self._examine_mesh_scale(body, geometry, path, np.array(scale), mass)
        return found

    def _examine_mesh_scale(
        self, body: BodyDescription, geometry: GeometryDescription, path: Path, scale: np.ndarray, mass: float
    ) -> bool:
        from ._make_urdf import _numbers
        from ._repair import repair
        from ._solids import read_mesh_file
        from ._units import guess_units, size_text

        try:
            mesh = read_mesh_file(path)
            volume = sum(_numbers(piece).volume for solid in mesh.solids for piece in repair(solid))
        except ValueError:
            return False
        mesh.declared = None if mesh.is_default else mesh.declared
        belief = guess_units(mesh, volume, mass if mass > 0.0 else None)
        size = size_text(np.abs(scale) * belief.size * (1.0 if mesh.is_plain else mesh.declared or 1.0))
        message = f"the mesh '{path.name}' of '{body.name}' is {size}; "
        if not belief.is_sure or np.allclose(np.abs(scale), belief.metres, rtol=1e-3):
            self._add("warning", "scale-odd", body.name, message + "check its unit", geometry.where)
            return False
        factor = belief.metres if mesh.is_plain else belief.metres / (mesh.declared or 1.0)
        message += f"it looks like {belief.Describe()}"
        edits = self._scale_edits(path, factor) if self._path.suffix.lower() == ".urdf" else []
        fix = f'scale="{factor:g} {factor:g} {factor:g}"'
        self._add("error", "scale-wrong", body.name, message, geometry.where, fix, edits)
        return True

    def _scale_edits(self, path: Path, factor: float) -> list[Edit]:
        """Gives every use of a mesh file another scale."""
        assert self._source is not None
        edits = []
        for link in self._source.root.find_all("link"):
            for role in link.find_all("visual", "collision"):
                mesh = next((g.find("mesh") for g in role.find_all("geometry") if g.find("mesh") is not None), None)
                if mesh is not None and Path(mesh.get("filename") or "").name == path.name:
                    edits.append(self._source.set_attribute(mesh, "scale", " ".join([repr(factor)] * 3)))
        return edits

    def _examine_rest(self) -> None:
        """Loads the model and looks for bodies that overlap in the default configuration."""
        from sheldrake.multibody.parsing import Parser
        from sheldrake.multibody.plant import AddMultibodyPlantSceneGraph
        from sheldrake.systems.framework import DiagramBuilder

        if any(finding.code == "scale-wrong" for finding in self._diagnosis.findings):
            return
        builder = DiagramBuilder()
        plant, scene_graph = AddMultibodyPlantSceneGraph(builder, 1e-3)
        parser = Parser(plant)
        parser._packages, parser._policy = self._packages, self._policy()
        reading = self._reading()
        reading.policy = parser._policy
        try:
            parser._add(self._path.suffix.lower(), reading, self._text)
            plant.Finalize()
            diagram = builder.Build()
            context = diagram.CreateDefaultContext()
            query = scene_graph.get_query_output_port().Eval(scene_graph.GetMyContextFromRoot(context))
            pairs = query.ComputePointPairPenetration()
        except (RuntimeError, NotImplementedError, ValueError) as error:
            if not self._diagnosis.errors():
                self._fail(error)
            return
        inspector = query.inspector()
        deepest: dict[tuple[str, str], float] = {}
        for pair in pairs:
            frames = (inspector.GetFrameId(pair.id_A), inspector.GetFrameId(pair.id_B))
            bodies: list[Any] = [plant.GetBodyFromFrameId(frame) for frame in frames]
            if all(body.is_floating_base_body() for body in bodies):
                continue  # free bodies start where the program puts them
            names = tuple(sorted(body.name() for body in bodies))
            deepest[names] = max(deepest.get(names, 0.0), pair.depth)  # type: ignore[index,arg-type]
        for (one, other), depth in sorted(deepest.items()):
            if depth > _TOUCHING:
                self._overlap(one, other, depth)

    def _overlap(self, one: str, other: str, depth: float) -> None:
        where, edits = None, []
        if self._source is not None:
            links = {e.get("name"): e for e in walk(self._source.root) if e.tag == "link"}
            where = links[other].where if other in links else None
            if self._path.suffix.lower() == ".urdf" and one in links and other in links:
                edits = self._filter_edits(self._source.root, one, other)
        self._add(
            "warning", "overlap", f"{one}, {other}", f"'{one}' and '{other}' overlap by {depth:.3g} m in the default "
            "configuration: contact will push them apart", where,
            "let them not collide (<drake:collision_filter_group>), or change geometry or default positions", edits,
        )  # fmt: skip

    def _filter_edits(self, root: Element, one: str, other: str) -> list[Edit]:
        assert self._source is not None
        group = f"{one}_and_{other}"
        lines = [
            f"  <drake:collision_filter_group name={quoteattr(group)}>",
            f"    <drake:member link={quoteattr(one)}/>",
            f"    <drake:member link={quoteattr(other)}/>",
            f"    <drake:ignored_collision_filter_group name={quoteattr(group)}/>",
            "  </drake:collision_filter_group>",
        ]
        edits = [self._source.append_to(root, "\n".join(lines) + "\n")]
        if "xmlns:drake" not in root.attributes:
            edits.append(self._source.set_attribute(root, "xmlns:drake", "https://drake.mit.edu"))
        return edits


def _same_lines(data: bytes, edit: Edit) -> Edit:
    """The edit with as many line breaks as what it replaces, so that places in the rest stay true."""
    missing = data.count(b"\n", edit.start, edit.end) - edit.text.count(b"\n")
    return edit._replace(text=edit.text + b"\n" * max(missing, 0))


def _standing_still(model: ModelDescription) -> set[str]:
    """Names of the bodies that are welded to the world, directly or through others."""
    welds = [joint for joint in model.joints() if joint.kind == "weld"]
    still: set[str] = set()
    while True:
        more = {
            b.name
            for joint in welds
            for a, b in ((joint.parent, joint.child), (joint.child, joint.parent))
            if (a.is_world or a.name in still) and not b.is_world and b.name not in still
        }
        if not more:
            return still
        still |= more


def _of_description(body: BodyDescription) -> tuple[float, np.ndarray, np.ndarray]:
    """Mass, centre of mass and inertia about it as the parser took them."""
    M = body.M_BBo_B
    if M is None:
        return 0.0, np.zeros(3), np.zeros((3, 3))
    p = np.asarray(M.get_com())
    mass = float(M.get_mass())
    I_BBo = np.asarray(M.CalcRotationalInertia().CopyToFullMatrix3())
    return mass, p, I_BBo - mass * (p @ p * np.eye(3) - np.outer(p, p))


def _written(link: Element | None) -> tuple[float, np.ndarray, np.ndarray] | None:
    """The same as a URDF's link has it in writing: the parser puts something else in the place of the impossible."""
    inertial = None if link is None else link.find("inertial")
    written = None if inertial is None else inertial.find("mass")
    if inertial is None or written is None or written.get("value") is None:
        return None
    from sheldrake.multibody.parsing._reading.reading import make_pose

    def numbers(element: Element | None, *names: str) -> list[float]:
        return [float((element.get(n) if element is not None else None) or 0.0) for n in names]

    origin, inertia = inertial.find("origin"), inertial.find("inertia")
    try:
        xyz, rpy = (
            [float(w) for w in ((origin.get(n) if origin is not None else None) or "0 0 0").split()]
            for n in ("xyz", "rpy")
        )
        Ixx, Iyy, Izz, Ixy, Ixz, Iyz = numbers(inertia, "ixx", "iyy", "izz", "ixy", "ixz", "iyz")
        (mass,) = numbers(written, "value")
    except ValueError:
        return None
    X_BI = make_pose(xyz, rpy)
    R = X_BI.rotation().matrix()
    I = R @ np.array([[Ixx, Ixy, Ixz], [Ixy, Iyy, Iyz], [Ixz, Iyz, Izz]]) @ R.T
    return mass, np.array(xyz), I


def _urdf_inertial(mass: float, p: np.ndarray, I: np.ndarray) -> str:
    xyz = " ".join(f"{x:.9g}" for x in p)
    moments = " ".join(f'{key}="{I[i, j]:.9g}"' for key, i, j in MOMENTS)
    return (
        f'<inertial>\n      <origin xyz="{xyz}" rpy="0 0 0"/>\n      <mass value="{mass!r}"/>\n'
        f"      <inertia {moments}/>\n    </inertial>"
    )


def _sdf_inertial(mass: float, p: np.ndarray, I: np.ndarray) -> str:
    xyz = " ".join(f"{x:.9g}" for x in p)
    moments = "".join(f"<{key}>{I[i, j]:.9g}</{key}>" for key, i, j in MOMENTS)
    return (
        f"<inertial>\n        <pose>{xyz} 0 0 0</pose>\n        <mass>{mass!r}</mass>\n"
        f"        <inertia>{moments}</inertia>\n      </inertial>"
    )
