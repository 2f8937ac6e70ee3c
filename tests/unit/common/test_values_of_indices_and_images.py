"""`Value[T]` of indices, images, colours and contacts: typed, held by copy."""

import pytest

from sheldrake.common.value import AbstractValue, Value
from sheldrake.geometry import RenderLabel, Rgba
from sheldrake.multibody.plant import CoulombFriction
from sheldrake.multibody.tree import BodyIndex, JointIndex
from sheldrake.systems.framework import InputPortIndex
from sheldrake.systems.sensors import ImageDepth32F, ImageRgba8U


@pytest.mark.parametrize(
    "held", [BodyIndex(3), InputPortIndex(2), Rgba(0.1, 0.2, 0.3, 0.4), RenderLabel(5)], ids=lambda h: type(h).__name__
)
def test_value_is_of_its_type(held):
    value = AbstractValue.Make(held)
    assert type(value) is Value[type(held)]
    assert value.get_value() == held == value.Clone().get_value()
    with pytest.raises(TypeError):
        value.set_value("something else")


def test_value_of_one_index_takes_no_other():
    with pytest.raises(TypeError):
        Value[BodyIndex]().set_value(JointIndex(1))


def test_image_is_copied_in():
    image = ImageRgba8U(4, 3, 7)
    value = Value[ImageRgba8U](image)
    image.mutable_data[:] = 0
    assert (value.get_value().data == 7).all()
    clone = value.Clone()
    value.get_mutable_value().mutable_data[:] = 1
    assert (clone.get_value().data == 7).all()
    assert Value[ImageDepth32F]().get_value().size() == 0


def test_friction():
    assert Value[CoulombFriction](CoulombFriction(0.9, 0.8)).get_value().static_friction() == 0.9
