"""Settings that Drake has had since later versions than the wheel at hand may be of."""

NEWER = {
    "geometry.RenderEngineGlParams": {"cast_shadows": "1.52", "shadow_map_size": "1.52"},
    "visualization.VisualizationConfig": {"mouse_interaction_stiffness": "1.56"},
}
"""The version that has a setting first, by class and setting."""


def newer_than(theirs, name):
    """Settings of NEWER that the wheel's class, called so below `pydrake`, does not have yet."""
    return set(NEWER.get(name, ())) - {field.name for field in theirs.__fields__}
