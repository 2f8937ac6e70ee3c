"""Which public names pydrake has, module by module: to tell a name still to come from a misspelt one."""

from __future__ import annotations

import functools
import json
import pathlib

NOT_PLANNED = {
    "deformable bodies are out of sheldrake's scope": (
        "pydrake.multibody.fem", "DeformableBodyConfig", "DeformableBodyConfig_", "DeformableBody", "DeformableBodyId",
        "DeformableBodyIndex", "DeformableContactInfo", "DeformableContactInfo_", "DeformableModel",
        "ForceDensityField", "ForceDensityField_", "ForceDensityFieldBase", "ForceDensityFieldBase_",
        "ForceDensityType", "GravityForceField", "GravityForceField_", "MaterialModel", "PhysicalModel",
    ),
}  # fmt: skip
"""Names of pydrake that sheldrake will not have, by reason; all others are to come."""


def reason_against(name: str) -> str | None:
    """Why a name, or a module by its full name, is not planned; None when it is."""
    return next((reason for reason, names in NOT_PLANNED.items() if name in names), None)


@functools.cache
def _table() -> dict[str, frozenset[str]]:
    text = pathlib.Path(__file__).with_suffix(".json").read_text(encoding="utf-8")
    return {module: frozenset(names) for module, names in json.loads(text).items()}


def is_module(name: str) -> bool:
    """Whether pydrake has the module `name`, such as `pydrake.solvers`."""
    return name in _table() or (name.endswith(".all") and name.removesuffix(".all") in _table())


def names_of(module: str) -> frozenset[str]:
    """The public names of pydrake's module, such as `pydrake.solvers`; empty for an unknown one."""
    return _table().get(module, frozenset())


def modules_with(name: str) -> list[str]:
    """The modules of pydrake that have the public name, such as `pydrake.systems.sensors` for `RgbdSensor`."""
    return sorted(module for module, names in _table().items() if name in names)
