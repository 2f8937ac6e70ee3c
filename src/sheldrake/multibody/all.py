"""Every public name of the modules of `sheldrake.multibody`."""

from sheldrake._pydrake.roll_up import roll_up

__all__ = roll_up(
    globals(),
    [
        "sheldrake.multibody.cenic",
        "sheldrake.multibody.contact_solvers",
        "sheldrake.multibody.inverse_kinematics",
        "sheldrake.multibody.fem",
        "sheldrake.multibody.math",
        "sheldrake.multibody.meshcat",
        "sheldrake.multibody.optimization",
        "sheldrake.multibody.parsing",
        "sheldrake.multibody.plant",
        "sheldrake.multibody.rational",
        "sheldrake.multibody.tree",
        "sheldrake.multibody.benchmarks.all",
    ],
)
