"""Images as messages."""

import numpy as np
import pytest

from sheldrake.geometry import Sphere
from sheldrake.lcm import DrakeLcm
from sheldrake.lcm._messages import lcmt_image, lcmt_image_array
from sheldrake.math import RigidTransform
from sheldrake.multibody.plant import AddMultibodyPlantSceneGraph
from sheldrake.systems.analysis import Simulator
from sheldrake.systems.framework import DiagramBuilder
from sheldrake.systems.lcm import LcmBuses
from sheldrake.systems.sensors import (
    ApplyCameraConfig,
    CameraConfig,
    Image,
    ImageToLcmImageArrayT,
    LcmImageArrayToImages,
    PixelType,
)


def numbered(kind, width=4, height=3):
    image = Image[kind](width, height)
    image.mutable_data[...] = np.arange(image.size()).reshape(image.shape)
    return image


def message_of(system, images, time=0.25):
    context = system.CreateDefaultContext()
    context.SetTime(time)
    for k, image in enumerate(images):
        system.get_input_port(k).FixValue(context, image)
    return system.image_array_t_msg_output_port().Eval(context)


def images_of(message):
    system = LcmImageArrayToImages()
    context = system.CreateDefaultContext()
    system.image_array_t_input_port().FixValue(context, message)
    ports = (system.color_image_output_port(), system.depth_image_output_port(), system.label_image_output_port())
    return [port.Eval(context) for port in ports]


@pytest.mark.parametrize("compress", [False, True])
def test_there_and_back(compress):
    system = ImageToLcmImageArrayT("color", "depth", "label", compress)
    ports = system.color_image_input_port(), system.depth_image_input_port(), system.label_image_input_port()
    assert [port.get_name() for port in ports] == ["color", "depth", "label"]
    images = [numbered(kind) for kind in (PixelType.kRgba8U, PixelType.kDepth32F, PixelType.kLabel16I)]
    message = lcmt_image_array.decode(message_of(system, images).encode())
    assert message.header.utime == 250000 and message.num_images == 3
    assert [image.header.frame_name for image in message.images] == ["color", "depth", "label"]
    assert all(image.size == len(image.data) for image in message.images)
    assert [image.row_stride for image in message.images] == [16, 16, 8]
    for found, image in zip(images_of(message), images):
        assert type(found) is type(image) and np.array_equal(found.data, image.data)


@pytest.mark.parametrize("kind", list(PixelType), ids=str)
def test_ports_for_every_kind_of_pixel(kind):
    system = ImageToLcmImageArrayT()
    assert system.DeclareImageInputPort[kind]("name").get_name() == "name"
    image = numbered(kind)
    color, depth, label = images_of(message_of(system, [image]))
    if kind in (PixelType.kRgb8U, PixelType.kBgr8U):
        order = [0, 1, 2] if kind is PixelType.kRgb8U else [2, 1, 0]
        assert np.array_equal(color.data[..., :3], image.data[..., order]) and (color.data[..., 3] == 255).all()
    elif kind is PixelType.kDepth16U:
        assert np.allclose(depth.data, image.data / 1000.0)
    sizes = [found.size() > 0 for found in (color, depth, label)]
    name = kind.name
    assert sizes == ["Rgb" in name or "Bgr" in name, "Depth" in name, "Label" in name]


def test_messages_that_make_no_sense():
    system = ImageToLcmImageArrayT(do_compress=False)
    system.DeclareImageInputPort[PixelType.kRgba8U]("c")
    for field, value, match in (
        ("pixel_format", 7, "pixel_format 7"),
        ("compression_method", 3, "compression_method 3"),
        ("width", 5, "48 bytes are not 5 x 3 pixels"),
    ):
        message = message_of(system, [numbered(PixelType.kRgba8U)])
        setattr(message.images[0], field, value)
        with pytest.raises(RuntimeError, match=match):
            images_of(message)
    for wrong in (("a", "b"), ("a", "b", "c", True, 1)):
        with pytest.raises(TypeError, match="incompatible"):
            ImageToLcmImageArrayT(*wrong)


def test_the_other_order_of_bytes_is_read():
    system = ImageToLcmImageArrayT()
    system.DeclareImageInputPort[PixelType.kLabel16I]("l")
    message = message_of(system, [numbered(PixelType.kLabel16I)])
    image = message.images[0]
    image.data, image.bigendian = np.frombuffer(image.data, "<i2").astype(">i2").tobytes(), True
    assert np.array_equal(images_of(message)[2].data, numbered(PixelType.kLabel16I).data)


@pytest.mark.parametrize(("delay", "first"), [(0.0, 20000), (0.05, 70050)])
@pytest.mark.parametrize("by", ["lcm", "lcm_buses"])
def test_a_configured_camera_sends_its_images(by, delay, first):
    builder = DiagramBuilder()
    plant, scene_graph = AddMultibodyPlantSceneGraph(builder, 0.01)
    plant.RegisterVisualGeometry(plant.world_body(), RigidTransform([0, 0, 1]), Sphere(0.1), "ball", [1, 0, 0, 1])
    plant.Finalize()
    lcm, got = DrakeLcm("memq://"), []
    lcm.Subscribe("DRAKE_RGBD_CAMERA_IMAGES_eye", lambda data: got.append(lcmt_image_array.decode(data)))
    buses = LcmBuses()
    buses.Add("mine", lcm)
    where = {"lcm": {"lcm": lcm}, "lcm_buses": {"lcm_buses": buses}}[by]
    config = CameraConfig(
        name="eye", width=64, height=48, depth=True, label=True, capture_offset=0.02, output_delay=delay, lcm_bus="mine"
    )
    ApplyCameraConfig(config, builder, plant=plant, scene_graph=scene_graph, **where)
    assert builder.HasSubsystemNamed("image_to_lcm_eye")
    assert builder.HasSubsystemNamed("LcmPublisherSystem(DRAKE_RGBD_CAMERA_IMAGES_eye)")
    Simulator(builder.Build()).AdvanceTo(0.2)
    lcm.HandleSubscriptions(0)
    assert [message.header.utime for message in got] == [first, first + 100000]
    last = got[0]
    assert [image.header.frame_name for image in last.images] == ["depth", "rgb", "label"]
    assert {image.compression_method for image in last.images} == {lcmt_image.COMPRESSION_METHOD_ZLIB}
    color, depth, label = images_of(last)
    assert color.data[24, 32, 0] > 200 and color.data[0, 0].tolist() == [204, 229, 255, 255]
    assert depth.data[24, 32, 0] == pytest.approx(0.9, abs=4e-3) and label.data[0, 0, 0] == 32766


def test_buses_that_are_not_there():
    def apply(**kwargs):
        builder = DiagramBuilder()
        AddMultibodyPlantSceneGraph(builder, 0.01)[0].Finalize()
        ApplyCameraConfig(CameraConfig(lcm_bus=kwargs.pop("bus", "default")), builder, **kwargs)
        return builder

    with pytest.raises(RuntimeError, match="non-default LCM bus 'foo'"):
        apply(bus="foo")
    with pytest.raises(RuntimeError, match="Camera 'preview_camera' requested an LCM bus 'foo'"):
        apply(bus="foo", lcm_buses=LcmBuses())
    for quiet in ({}, {"lcm": DrakeLcm("memq://null")}):
        assert not apply(**quiet).HasSubsystemNamed("image_to_lcm_preview_camera")
