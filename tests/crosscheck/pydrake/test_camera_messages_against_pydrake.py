"""Messages of images against Drake's, byte by byte."""

import importlib

import numpy as np
import pytest

from sheldrake.lcm._messages import lcmt_image_array as our_type

pytestmark = pytest.mark.peer
pytest.importorskip("pydrake.systems.sensors")
drake_type = pytest.importorskip("drake").lcmt_image_array


def published(library, lcm_type, compress, **make):
    """The bytes of a message with a colour, a depth and a label image."""
    framework, lcm, analysis, primitives, sensors, systems_lcm = (
        importlib.import_module(f"{library}.{name}")
        for name in (
            "systems.framework",
            "lcm",
            "systems.analysis",
            "systems.primitives",
            "systems.sensors",
            "systems.lcm",
        )
    )
    value = importlib.import_module(f"{library}.common.value")
    bus, got, builder = lcm.DrakeLcm("memq://"), [], framework.DiagramBuilder()
    bus.Subscribe("images", got.append)
    packer = builder.AddSystem(sensors.ImageToLcmImageArrayT("color", "depth", "label", compress))
    for k, cls in enumerate((sensors.ImageRgba8U, sensors.ImageDepth32F, sensors.ImageLabel16I)):
        image = cls(8, 6)
        image.mutable_data[...] = np.arange(image.size()).reshape(image.shape)
        source = builder.AddSystem(primitives.ConstantValueSource(value.AbstractValue.Make(image)))
        builder.Connect(source.get_output_port(), packer.get_input_port(k))
    sender = systems_lcm.LcmPublisherSystem.Make("images", lcm_type, bus, publish_period=0.1, **make)
    builder.AddSystem(sender)
    builder.Connect(packer.get_output_port(), sender.get_input_port())
    analysis.Simulator(builder.Build()).AdvanceTo(0.15)
    bus.HandleSubscriptions(0)
    return got[-1]


def test_plain_messages_are_the_same_bytes():
    theirs = published("pydrake", drake_type, False, use_cpp_serializer=True)
    assert published("sheldrake", our_type, False) == theirs
    assert published("sheldrake", our_type, True) != theirs


def test_compressed_messages_are_read_by_the_other():
    theirs = published("pydrake", drake_type, True, use_cpp_serializer=True)
    ours = published("sheldrake", our_type, True)
    plain = our_type.decode(published("sheldrake", our_type, False))
    from sheldrake.systems.sensors._lcm_images import unpacked_image

    for message in (our_type.decode(theirs), drake_type.decode(ours)):
        assert message.header.utime == plain.header.utime and message.num_images == 3
        for image, expected in zip(message.images, plain.images):
            assert np.array_equal(unpacked_image(image).data, unpacked_image(expected).data)
