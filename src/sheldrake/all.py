"""Every public name of sheldrake in one place, for notebooks and short scripts: `from sheldrake.all import *`.

Where two modules have the same name, the one that pydrake.all gives is here. Programs are clearer, and start faster,
when they import from the modules themselves.
"""

from sheldrake._pydrake.roll_up import roll_up

_MODULES = [
    "sheldrake.autodiffutils",
    "sheldrake.forwarddiff",
    "sheldrake.lcm",
    "sheldrake.manipulation",
    "sheldrake.math",
    "sheldrake.perception",
    "sheldrake.planning",
    "sheldrake.polynomial",
    "sheldrake.solvers",
    "sheldrake.symbolic",
    "sheldrake.trajectories",
    "sheldrake.common",  # for the names it had; all of it is in the next
    "sheldrake.common.all",
    "sheldrake.geometry.all",
    "sheldrake.multibody.all",
    "sheldrake.systems.all",
    "sheldrake.visualization",
    "sheldrake.math",  # once more: its sin, cos ... take every scalar and win over symbolic's
]

__all__ = roll_up(globals(), _MODULES)
