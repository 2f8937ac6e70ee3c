"""Drake's modelling system for robots, in Python all the way down.

Names are pydrake's, from the same modules: `from sheldrake.systems.framework import DiagramBuilder`, or all of them
from `sheldrake.all`. GUIDE.md in this folder (`sheldrake guide`) has ten idioms, how to read errors, and what differs
from pydrake and MuJoCo.
"""

import pathlib

__version__ = "0.1.0"
__all__ = ["__version__", "model_path"]


def model_path(name: str) -> str:
    """Full path of a model that comes with the library, such as "two_hole_block/two_hole_block.urdf".

    Raises:
        FileNotFoundError: if there is none of that name; the message lists those that exist.
    """
    folder = pathlib.Path(__file__).resolve().parent / "models"
    path = folder / name
    if not path.is_file() or folder not in path.resolve().parents:
        names = sorted(
            p.relative_to(folder).as_posix() for p in folder.rglob("*") if p.suffix in {".urdf", ".sdf", ".xml"}
        )
        raise FileNotFoundError(f"model_path(): there is no model {name!r}; there are {', '.join(names)}.")
    return str(path)
