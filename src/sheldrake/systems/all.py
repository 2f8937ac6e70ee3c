"""Every public name of the modules of `sheldrake.systems`."""

from sheldrake._pydrake.roll_up import roll_up

__all__ = roll_up(
    globals(),
    [
        "sheldrake.systems.analysis",
        "sheldrake.systems.controllers",
        "sheldrake.systems.drawing",
        "sheldrake.systems.estimators",
        "sheldrake.systems.framework",
        "sheldrake.systems.lcm",
        "sheldrake.systems.perception",
        "sheldrake.systems.planar_scenegraph_visualizer",
        "sheldrake.systems.primitives",
        "sheldrake.systems.pyplot_visualizer",
        "sheldrake.systems.rendering",
        "sheldrake.systems.scalar_conversion",
        "sheldrake.systems.sensors",
    ],
)
