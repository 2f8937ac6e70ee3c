"""From CAD to simulation: meshes to robot descriptions, with units, mass and inertia that hold."""

from ._make_urdf import MakeUrdfFromMesh, MeshModel, UnitsUnsure
from ._units import UnitBelief

__all__ = ["MakeUrdfFromMesh", "MeshModel", "UnitBelief", "UnitsUnsure"]
