"""Which elements and attributes SDFormat defines within which, of those that are read here or stand beside such.

The specification (sdformat.org/spec, 1.4 to 1.12) is the source. Drake refuses a file with others, and with extensions
of its own that it does not know where it looks for extensions. Names with other prefixes are anybody's.
"""

from .._files.xml import Element
from .._reading.reading import Reading

_DEFINED = {
    tag: frozenset(children.split())
    for tag, children in {
        "sdf": "actor light model world",
        "world": "actor atmosphere audio frame gravity gui include joint light magnetic_field model physics plugin "
        "population road scene spherical_coordinates state wind",
        "model": "allow_auto_disable enable_wind frame gripper include joint link model plugin pose self_collide "
        "static",
        "link": "audio_sink audio_source battery collision enable_wind gravity inertial kinematic light "
        "must_be_base_link particle_emitter pose projector self_collide sensor velocity_decay visual",
        "inertial": "auto_inertia_params density fluid_added_mass inertia mass pose",
        "inertia": "ixx ixy ixz iyy iyz izz",
        "visual": "cast_shadows geometry laser_retro material meta plugin pose transparency visibility_flags",
        "collision": "auto_inertia_params density geometry laser_retro max_contacts pose surface",
        "geometry": "box capsule cone cylinder ellipsoid empty heightmap image mesh plane polyline sphere",
        "box": "size",
        "capsule": "length radius",
        "cylinder": "length radius",
        "ellipsoid": "radii",
        "mesh": "convex_decomposition scale submesh uri",
        "plane": "normal size",
        "sphere": "radius",
        "material": "ambient diffuse double_sided emissive lighting pbr render_order script shader shininess specular",
        "surface": "bounce contact friction soft_contact",
        "friction": "bullet ode torsional",
        "joint": "axis axis2 child gearbox_ratio gearbox_reference_body parent physics pose screw_thread_pitch sensor "
        "thread_pitch",
        "axis": "dynamics initial_position limit mimic use_parent_model_frame xyz",
        "axis2": "dynamics initial_position limit mimic use_parent_model_frame xyz",
        "limit": "dissipation effort lower stiffness upper velocity",
        "dynamics": "damping friction spring_reference spring_stiffness",
        "mimic": "multiplier offset reference",
        "frame": "pose",
    }.items()
}
_ATTRIBUTES = {
    "sdf": "version",
    "world": "name",
    "model": "name canonical_link placement_frame",
    "link": "name",
    "inertial": "auto",
    "visual": "name",
    "collision": "name",
    "joint": "name type",
    "frame": "name attached_to",
    "mesh": "optimization",
    "mimic": "joint",
    "pose": "relative_to frame degrees rotation_format",
    "xyz": "expressed_in",
}
"""Attributes of those of the elements above and below that have any."""
_LEAVES = frozenset(
    "allow_auto_disable ambient child damping diffuse effort emissive enable_wind gravity ixx ixy ixz iyy iyz izz "
    "length lower mass mu mu2 normal ode parent pose radii radius scale self_collide size specular "
    "spring_reference spring_stiffness static upper uri velocity xyz".split()
)
"""Elements that are read here, and have no others inside that have attributes."""
_EXTENDED = (
    "sdf",
    "world",
    "model",
    "link",
    "visual",
    "collision",
    "geometry",
    "material",
    "joint",
    "limit",
    "drake:proximity_properties",
    "drake:joint",
    "drake:linear_bushing_rpy",
)
"""Where Drake looks for extensions, and knows them all."""


def refuse_undefined(element: Element, child: Element, reading: Reading) -> None:
    """Fails where SDFormat does not define a child that no one reads, and Drake does not extend it so.

    Raises:
        ParseError: Naming the elements that are defined.
    """
    prefix, colon, _ = child.tag.rpartition(":")
    if not colon:
        defined = _DEFINED.get(element.tag)
        if defined is not None and child.tag not in defined:
            known = ", ".join(f"<{tag}>" for tag in sorted(defined))
            reading.fail(child, f"SDFormat has no <{child.tag}> inside <{element.tag}>; it has {known}.")
    elif prefix == "drake" and element.tag in _EXTENDED:
        reading.fail(child, f"The extension <{child.tag}> inside <{element.tag}> is unknown.")


def refuse_undefined_attribute(element: Element, attribute: str, reading: Reading) -> None:
    """Fails where SDFormat does not define an attribute that no one reads; those with prefixes are anybody's.

    Raises:
        ParseError: Naming the attributes that are defined.
    """
    defined = _ATTRIBUTES.get(element.tag, "").split()
    if (element.tag in _DEFINED or element.tag in _LEAVES) and ":" not in attribute and attribute not in defined:
        known = ", ".join(f"'{name}'" for name in defined) or "none"
        where = element.where_attribute(attribute)
        reading.fail(where, f"SDFormat has no attribute '{attribute}' of <{element.tag}>; it has {known}.")
