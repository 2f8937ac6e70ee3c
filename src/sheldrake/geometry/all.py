"""Every public name of `sheldrake.geometry` and its modules."""

from sheldrake._pydrake.roll_up import roll_up

__all__ = roll_up(globals(), ["sheldrake.geometry", "sheldrake.geometry.optimization"])
