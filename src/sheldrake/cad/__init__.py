"""From CAD to simulation: meshes to robot descriptions, their faults, and conversion between formats."""

from sheldrake.common._names import show_as_own

from ._convert import ConvertModel, WriteModel, WrittenModel
from ._doctor import DiagnoseModel
from ._explain_failure import ExplainFailure
from ._findings import Diagnosis, Finding
from ._make_urdf import MakeUrdfFromMesh, MeshModel, UnitsUnsure
from ._units import UnitBelief

__all__ = [
    "ConvertModel",
    "DiagnoseModel",
    "Diagnosis",
    "ExplainFailure",
    "Finding",
    "MakeUrdfFromMesh",
    "MeshModel",
    "UnitBelief",
    "UnitsUnsure",
    "WriteModel",
    "WrittenModel",
]

show_as_own(globals())
