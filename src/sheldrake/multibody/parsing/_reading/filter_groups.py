"""Collision filter groups, which URDF and SDFormat write alike but for where the names stand."""

from collections.abc import Callable

from .._files.xml import Element
from .._model.description import FilterGroupDescription, ModelDescription
from .reading import Reading

MEMBER = "drake:member"
_TAGS = (MEMBER, "drake:member_group", "drake:ignored_collision_filter_group")


def read_filter_group(
    element: Element, model: ModelDescription, reading: Reading, name_of: Callable[[Element], str]
) -> None:
    """Adds a `<drake:collision_filter_group>` to a model, unless there is no geometry or it says to ignore it.

    Args:
        element: The element.
        model: The model.
        reading: Its surroundings.
        name_of: Reads the name of a child element.
    """
    if not reading.wants_geometry:
        reading.pass_over(element)
        return
    name = reading.name(element, f"<{element.tag}>")
    ignore = element.get("ignore")
    if ignore is not None and reading.parse_bool(ignore, element.where_attribute("ignore"), "attribute 'ignore'"):
        reading.pass_over(element)
        return
    reading.warn_unknown(element, _TAGS, ("name", "ignore"))
    lists = [[name_of(child) for child in element.find_all(tag)] for tag in _TAGS]
    model.filter_groups.append(FilterGroupDescription(element.where, name, *lists))
