"""Robot descriptions from one format to another, and plants to files."""

from __future__ import annotations

import os
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from os import PathLike

    from sheldrake.geometry import SceneGraph
    from sheldrake.multibody.parsing import PackageMap
    from sheldrake.multibody.plant import MultibodyPlant


@dataclass
class WrittenModel:
    """A description that was written.

    Attributes:
        path: The file.
        files: Mesh files written beside it.
        losses: What the file does not say although the model has it, one text each.
        notes: What else is good to know, one text each.
    """

    path: Path
    files: list[Path] = field(default_factory=list)
    losses: list[str] = field(default_factory=list)
    notes: list[str] = field(default_factory=list)


def WriteModel(
    plant: MultibodyPlant, path: str | PathLike[str], scene_graph: SceneGraph | None = None, *, obj_meshes: bool = False
) -> WrittenModel:
    """Writes what is in a plant as URDF, SDFormat or MJCF, by the ending of the path.

    Links, inertias, joints, limits, damping, springs, actuators, mimic, fixed frames, geometry with its roles, colours
    and contact properties, collision filters. The file loads to a plant of the same dynamics; what the format has no
    word for is named in `losses`.

    Args:
        plant: A MultibodyPlant; finalized, or the default poses of free bodies are not known.
        path: Where to write: `.urdf`, `.sdf`, or `.xml` for MJCF.
        scene_graph: The plant's SceneGraph, or None to write no geometry.
        obj_meshes: Write meshes of formats that Drake does not read (STL, DAE, PLY) as OBJ beside the file. For MJCF
            those that MuJoCo does not read are always written so.

    Raises:
        ValueError: An ending without a writer, or a body without a finite mass.
        FileNotFoundError: The folder to write to does not exist.
        NotImplementedError: A joint that the format does not have.
    """
    from ._mesh_files import MeshFiles, check_folder
    from ._model_parts import take_apart
    from ._write_mjcf import MESHES, mjcf_text
    from ._write_sdf import sdf_text
    from ._write_urdf import urdf_text

    path = Path(path)
    writers = {".urdf": urdf_text, ".sdf": sdf_text, ".xml": mjcf_text, ".mjcf": mjcf_text}
    suffix = path.suffix.lower()
    if suffix not in writers:
        raise ValueError(f"WriteModel(): '{path}' ends with none of {', '.join(writers)}.")
    check_folder("WriteModel()", path)
    inspector = None if scene_graph is None else scene_graph.model_inspector()
    parts = take_apart(plant, inspector, path.stem)
    is_mjcf = writers[suffix] is mjcf_text
    meshes = MeshFiles(path.parent, True, MESHES) if is_mjcf else MeshFiles(path.parent, obj_meshes)
    path.write_text(writers[suffix](parts, path.parent, meshes), encoding="utf-8")
    written = WrittenModel(path, meshes.written, parts.losses)
    if meshes.foreign:
        names = ", ".join(meshes.foreign[:3]) + (", ..." if len(meshes.foreign) > 3 else "")
        written.notes.append(
            f"Drake does not read meshes such as {names}; --obj-meshes (obj_meshes=True) makes OBJ of them"
        )
    return written


def ConvertModel(
    source: str | PathLike[str],
    target: str | PathLike[str],
    package_map: PackageMap | None = None,
    *,
    obj_meshes: bool = False,
) -> WrittenModel:
    """Reads a description and writes it in another format, or in the same one with everything spelt out.

    Args:
        source: A file that the Parser takes: URDF, SDFormat, MJCF, model directives, OBJ.
        target: `.urdf`, `.sdf`, or `.xml` for MJCF.
        package_map: Where `package://` addresses lead (a PackageMap).
        obj_meshes: As WriteModel.

    Returns:
        What was written. `losses` has what the parser ignored, too.

    Raises:
        RuntimeError: The source can not be read.
        ValueError: The target is the source, or as WriteModel.
        FileNotFoundError, NotImplementedError: As WriteModel.
    """
    from sheldrake.multibody.parsing import Parser
    from sheldrake.multibody.plant import AddMultibodyPlantSceneGraph
    from sheldrake.systems.framework import DiagramBuilder

    if os.path.realpath(source) == os.path.realpath(target):
        raise ValueError(f"ConvertModel(): '{target}' is the source itself; what it says would be lost. Name another.")
    plant, scene_graph = AddMultibodyPlantSceneGraph(DiagramBuilder(), 1e-3)
    parser = Parser(plant)
    if package_map is not None:
        parser.package_map().AddMap(package_map)
    ignored: list[str] = []
    parser.diagnostic_policy().SetActionForWarnings(lambda detail: ignored.append(detail.FormatWarning()))
    parser.AddModels(str(source))
    plant.Finalize()
    written = WriteModel(plant, target, scene_graph, obj_meshes=obj_meshes)
    written.losses[:0] = ignored
    return written
