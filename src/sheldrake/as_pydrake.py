"""Import this module, and `import pydrake` means sheldrake, in this process, from then on.

    import sheldrake.as_pydrake
    from pydrake.all import *

`pydrake.systems.framework` is then the very module `sheldrake.systems.framework`, whether or not Drake itself is
installed; names that Drake retired since 2021 are there with a hint; a name of pydrake that sheldrake does not have
yet raises an error that says so.

Where a default of Drake's differs from sheldrake's, what is built by a name imported from pydrake has Drake's, and what
is built by a name imported from sheldrake, in the same program, has sheldrake's. Modules with such names (`SceneGraph`,
`AddMultibodyPlantSceneGraph`, `AddMultibodyPlant`, `RobotDiagramBuilder`) are modules of their own; all their other
names are the very objects of sheldrake's.

`sheldrake run script.py` does this for a script that knows nothing of sheldrake.
"""

from sheldrake._pydrake.alias import install, missing_name

__all__ = ["install", "missing_name"]

install()
