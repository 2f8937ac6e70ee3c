"""The roles a geometry can play."""

from sheldrake.common._enums import IndexEnum


class Role(IndexEnum):
    """What a geometry is for; one geometry can have several roles."""

    kUnassigned = 0
    kProximity = 1
    kIllustration = 2
    kPerception = 4

    def __lt__(self, other: "Role") -> bool:
        return self.value < other.value if isinstance(other, Role) else NotImplemented

    def __le__(self, other: "Role") -> bool:
        return self.value <= other.value if isinstance(other, Role) else NotImplemented

    def __gt__(self, other: "Role") -> bool:
        return self.value > other.value if isinstance(other, Role) else NotImplemented

    def __ge__(self, other: "Role") -> bool:
        return self.value >= other.value if isinstance(other, Role) else NotImplemented


class RoleAssign(IndexEnum):
    """Whether `SceneGraph.AssignRole()` gives a role for the first time or replaces its properties."""

    kNew = 0
    kReplace = 1


class HydroelasticContactRepresentation(IndexEnum):
    """How a hydroelastic contact surface is tessellated."""

    kTriangle = 0
    kPolygon = 1


class CollisionFilterScope(IndexEnum):
    """Which geometries a CollisionFilterDeclaration speaks of."""

    kAll = 0
    kOmitDeformable = 1


class HydroelasticType(IndexEnum):
    """Value of the proximity property ("hydroelastic", "compliance_type")."""

    kUndefined = 0
    kRigid = 1
    kCompliant = 2
