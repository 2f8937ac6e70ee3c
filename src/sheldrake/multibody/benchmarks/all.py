"""Every public name of the modules of `sheldrake.multibody.benchmarks`."""

from sheldrake._pydrake.roll_up import roll_up

__all__ = roll_up(globals(), ["sheldrake.multibody.benchmarks", "sheldrake.multibody.benchmarks.acrobot"])
