"""Robot descriptions (URDF, SDFormat, MJCF, model directives) to a MultibodyPlant."""

from ._collision_filter_groups import CollisionFilterGroups
from ._diagnostics import DiagnosticPolicy, ParseError
from ._model_directives import (
    AddCollisionFilterGroup,
    AddDirectives,
    AddFrame,
    AddModel,
    AddModelInstance,
    AddWeld,
    LoadModelDirectives,
    LoadModelDirectivesFromString,
    ModelDirective,
    ModelDirectives,
)
from ._package_map import PackageMap
from ._parser import Parser
from ._process_directives import FlattenModelDirectives, ModelInstanceInfo, ProcessModelDirectives
from ._scoped_names import GetScopedFrameByName, GetScopedFrameByNameMaybe

__all__ = [
    "AddCollisionFilterGroup",
    "AddDirectives",
    "AddFrame",
    "AddModel",
    "AddModelInstance",
    "AddWeld",
    "CollisionFilterGroups",
    "DiagnosticPolicy",
    "FlattenModelDirectives",
    "GetScopedFrameByName",
    "GetScopedFrameByNameMaybe",
    "LoadModelDirectives",
    "LoadModelDirectivesFromString",
    "ModelDirective",
    "ModelDirectives",
    "ModelInstanceInfo",
    "PackageMap",
    "ParseError",
    "Parser",
    "ProcessModelDirectives",
]
