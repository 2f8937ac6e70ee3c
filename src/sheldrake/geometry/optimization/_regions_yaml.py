"""Regions in YAML files."""

from __future__ import annotations

import pathlib
from typing import TYPE_CHECKING

import numpy as np

from sheldrake.common._checked import checked
from sheldrake.geometry.optimization._hpolyhedron import HPolyhedron

if TYPE_CHECKING:
    from collections.abc import Iterable
    from os import PathLike


def _numbers(values: Iterable[float]) -> str:
    return "[" + ", ".join(repr(float(v)) for v in values) + "]"


@checked
def SaveIrisRegionsYamlFile(
    filename: str | PathLike[str], regions: dict[str, HPolyhedron], child_name: str | None = None
) -> None:
    """Writes named regions to a YAML file.

    Args:
        filename: The file.
        regions: Regions by name.
        child_name: A name to put them under.
    """
    lines = [f"{child_name}:"] if child_name is not None else []
    indent = "  " if child_name is not None else ""
    for name in sorted(regions):
        region = regions[name]
        lines += [f"{indent}{name}:", f"{indent}  ambient_dimension: {region.ambient_dimension()}", f"{indent}  A:"]
        lines += [f"{indent}    - {_numbers(row)}" for row in region.A()]
        lines.append(f"{indent}  b: {_numbers(region.b())}")
    pathlib.Path(filename).write_text("\n".join(lines) + "\n", encoding="utf-8")


@checked
def LoadIrisRegionsYamlFile(filename: str | PathLike[str], child_name: str | None = None) -> dict[str, HPolyhedron]:
    """Returns named regions from a YAML file.

    Args:
        filename: The file.
        child_name: The name they are under.

    Raises:
        RuntimeError: there is no such name.
    """
    import yaml

    content = yaml.safe_load(pathlib.Path(filename).read_text(encoding="utf-8"))
    if child_name is not None:
        if child_name not in content:
            raise RuntimeError(f"LoadIrisRegionsYamlFile(): {filename} has no {child_name!r}; it has {list(content)}.")
        content = content[child_name]
    return {
        name: HPolyhedron(np.array(r["A"], dtype=float), np.array(r["b"], dtype=float)) for name, r in content.items()
    }
