"""Drake's own elements in SDFormat models, whose names and numbers are the text of elements."""

import numpy as np

from .._files.xml import Element
from .._model.description import FrameReference, ModelDescription
from .._reading.extensions import EXTENSIONS, ExtensionReader
from .._reading.filter_groups import read_filter_group
from .children import text_number
from .joints import frame_reference
from .prepare import PreparedModel


class _SdfExtensions(ExtensionReader):
    def __init__(self, description: ModelDescription, model: PreparedModel):
        super().__init__(description, model.reading)
        self._scope = model.scope

    def child(self, element: Element, tag: str) -> Element:
        child = super().child(element, tag)
        if not child.text.strip():
            self.reading.fail(element, f"<{element.tag}> needs a <{tag}>.")
        return child

    def number_in(self, child: Element) -> float:
        return text_number(child, self.reading)

    def vector_in(self, child: Element) -> np.ndarray:
        return self.reading.parse_vector(child.text, 3, child.where, f"<{child.tag}>")

    def frame_in(self, child: Element) -> FrameReference:
        return frame_reference(self._scope, child.text.strip(), child)

    def body_in(self, child: Element) -> FrameReference:
        name = child.text.strip()
        if name != "world" and self._scope.find(name, child.where)[1].kind != "link":
            self.reading.fail(child, f"<{child.tag}> names '{name}', which is not a link.")
        return self.frame_in(child)


def read_extensions(model: PreparedModel, description: ModelDescription) -> None:
    """Adds all of a model's to its description."""
    reader = _SdfExtensions(description, model)
    for element in model.elements:
        if element.tag == "drake:collision_filter_group":
            read_filter_group(element, description, model.reading, lambda child: child.text.strip())
        elif element.tag in EXTENSIONS:
            EXTENSIONS[element.tag](reader, element)
