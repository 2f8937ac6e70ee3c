"""Every public name of `sheldrake.common` and its modules."""

from sheldrake._roll_up import roll_up

__all__ = roll_up(
    globals(),
    [
        "sheldrake.common",
        "sheldrake.common.compatibility",
        "sheldrake.common.containers",
        "sheldrake.common.eigen_geometry",
        "sheldrake.common.schema",
        "sheldrake.common.yaml",
        "sheldrake.common.value",
    ],
)
