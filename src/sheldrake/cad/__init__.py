"""From CAD to simulation: meshes to robot descriptions, and descriptions looked through for faults."""

from ._doctor import DiagnoseModel
from ._findings import Diagnosis, Finding
from ._make_urdf import MakeUrdfFromMesh, MeshModel, UnitsUnsure
from ._units import UnitBelief

__all__ = ["DiagnoseModel", "Diagnosis", "Finding", "MakeUrdfFromMesh", "MeshModel", "UnitBelief", "UnitsUnsure"]
