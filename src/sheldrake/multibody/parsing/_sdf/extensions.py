"""Drake's extension tags of SDFormat models: filter groups, bushings, springs, constraints."""

from typing import Any

import numpy as np

from .._files.xml import Element
from .._model.description import (
    BallConstraintDescription,
    BushingDescription,
    FrameReference,
    ModelDescription,
    SpringDamperDescription,
    TendonDescription,
)
from .._reading.filter_groups import read_filter_group
from .._reading.joints import check_spring_damper
from .._reading.reading import Reading
from .children import child_number, child_vector
from .joints import frame_reference
from .prepare import PreparedModel


def _read_filter_group(element: Element, description: ModelDescription, model: PreparedModel) -> None:
    read_filter_group(element, description, model.reading, lambda child: child.text.strip())


def _require(element: Element, tag: str, reading: Reading) -> Element:
    child = element.find(tag)
    if child is None or not child.text.strip():
        reading.fail(element, f"<{element.tag}> needs a <{tag}>.")
    return child


def _frame_of(element: Element, tag: str, model: PreparedModel) -> FrameReference:
    child = _require(element, tag, model.reading)
    return frame_reference(model.scope, child.text.strip(), child)


def _body_of(element: Element, tag: str, model: PreparedModel) -> FrameReference:
    child = _require(element, tag, model.reading)
    name = child.text.strip()
    if name != "world" and model.scope.find(name, child.where)[1].kind != "link":
        model.reading.fail(child, f"<{tag}> names '{name}', which is not a link.")
    return frame_reference(model.scope, name, child)


def _vector(element: Element, tag: str, reading: Reading):
    _require(element, tag, reading)
    return child_vector(element, tag, 3, reading)


def _read_bushing(element: Element, description: ModelDescription, model: PreparedModel) -> None:
    prefix = "drake:bushing_"
    names = ("torque_stiffness", "torque_damping", "force_stiffness", "force_damping")
    model.reading.warn_unknown(element, [prefix + name for name in ("frameA", "frameC", *names)])
    frame_a, frame_c = (_frame_of(element, prefix + name, model) for name in ("frameA", "frameC"))
    constants = [_vector(element, prefix + name, model.reading) for name in names]
    description.elements.append(BushingDescription(element.where, frame_a, frame_c, *constants))


def _read_spring_damper(element: Element, description: ModelDescription, model: PreparedModel) -> None:
    prefix, reading = "drake:linear_spring_damper_", model.reading
    names = ("body_A", "p_AP", "body_B", "p_BQ", "free_length", "stiffness", "damping")
    reading.warn_unknown(element, [prefix + name for name in names])
    values: list[Any] = []
    for name in names:
        _require(element, prefix + name, reading)
        if name.startswith("body"):
            values.append(_body_of(element, prefix + name, model))
        elif name.startswith("p_"):
            values.append(_vector(element, prefix + name, reading))
        else:
            values.append(child_number(element, prefix + name, reading))
    spring = SpringDamperDescription(element.where, *values)
    check_spring_damper(spring, reading)
    description.elements.append(spring)


def _read_ball_constraint(element: Element, description: ModelDescription, model: PreparedModel) -> None:
    prefix, reading = "drake:ball_constraint_", model.reading
    reading.warn_unknown(element, [prefix + name for name in ("body_A", "p_AP", "body_B", "p_BQ")])
    description.elements.append(
        BallConstraintDescription(
            element.where,
            _body_of(element, prefix + "body_A", model),
            _vector(element, prefix + "p_AP", reading),
            _body_of(element, prefix + "body_B", model),
            _vector(element, prefix + "p_BQ", reading),
        )
    )


def _read_tendon(element: Element, description: ModelDescription, model: PreparedModel) -> None:
    prefix, reading = "drake:tendon_constraint_", model.reading
    numbers = ("offset", "lower_limit", "upper_limit", "stiffness", "damping")
    reading.warn_unknown(element, [prefix + name for name in ("joint", *numbers)])
    joints, coefficients = [], []
    for child in element.find_all(prefix + "joint"):
        reading.warn_unknown(child, attributes=("name", "a"))
        name, a = reading.name(child, f"<{child.tag}>"), reading.number(child, "a")
        if name not in model.scope.places or model.scope.places[name].kind != "joint" or a is None:
            reading.fail(child, f"<{child.tag}> needs the name of a joint of the model and the attribute 'a'.")
        joints.append(name)
        coefficients.append(a)
    if not joints:
        reading.fail(element, f"<{element.tag}> needs at least one <{prefix}joint>.")
    values = [child_number(element, prefix + name, reading) for name in numbers]
    description.elements.append(TendonDescription(element.where, joints, np.array(coefficients), *values))


EXTENSION_READERS = {
    "drake:collision_filter_group": _read_filter_group,
    "drake:linear_bushing_rpy": _read_bushing,
    "drake:linear_spring_damper": _read_spring_damper,
    "drake:ball_constraint": _read_ball_constraint,
    "drake:tendon_constraint": _read_tendon,
}
