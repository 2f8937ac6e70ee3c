"""Names `inner::link` in models of worlds before SDFormat 1.8: what Gazebo made of nested models when it saved a world.

Since 1.8 names must not contain `::`; a world that is older is read as if what they scope were in nested models.
"""

from .._files.xml import Element

NAMES_WITHOUT_SCOPES = (1, 8)  # since then
_NAMED = ("link", "joint", "frame", "model")
_REFERENCES = ("relative_to", "attached_to", "expressed_in")


def with_nested_models(model: Element) -> Element:
    """A copy of a `<model>` in which what is named `inner::name` is the `name` of a nested model `inner`.

    What it refers to is looked up in there.
    """
    result, nested = _copy(model, []), dict[str, Element]()
    for child in model:
        inner, separator, _ = child.get("name", "").partition("::")
        if not separator or child.tag not in _NAMED:
            result.children.append(child)
            continue
        if inner not in nested:
            nested[inner] = child.renamed("model")
            nested[inner].attributes, nested[inner].children = {"name": inner}, []
            result.children.append(nested[inner])
        nested[inner].children.append(_seen_from(inner, child, ("name", *_REFERENCES)))
    result.children = [with_nested_models(c) if c in nested.values() else c for c in result.children]
    return result


def _copy(element: Element, children: "list[Element]") -> Element:
    copy = element.renamed(element.tag)
    copy.children = children
    return copy


def _seen_from(inner: str, element: Element, references=_REFERENCES) -> Element:
    """A copy in which names in the nested model are without its own."""
    prefix = f"{inner}::"
    copy = _copy(element, [_seen_from(inner, child) for child in element])
    for reference in references:
        if reference in copy.attributes:
            copy.attributes[reference] = copy.attributes[reference].removeprefix(prefix)
    if element.tag in ("parent", "child"):
        copy.text = element.text.strip().removeprefix(prefix)
    return copy
