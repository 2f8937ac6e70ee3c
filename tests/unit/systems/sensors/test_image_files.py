"""Images to files and back; ImageWriter."""

import numpy as np
import pytest

from sheldrake.common.value import AbstractValue
from sheldrake.systems.analysis import Simulator
from sheldrake.systems.framework import DiagramBuilder
from sheldrake.systems.primitives import ConstantValueSource
from sheldrake.systems.sensors import (
    Image,
    ImageBgr8U,
    ImageBgra8U,
    ImageDepth16U,
    ImageDepth32F,
    ImageFileFormat,
    ImageGrey8U,
    ImageIo,
    ImageLabel16I,
    ImageRgb8U,
    ImageRgba8U,
    ImageWriter,
    PixelFormat,
    PixelScalar,
    PixelType,
)

pytest.importorskip("PIL.Image")
io = ImageIo()


def random_image(cls, width=7, height=5):
    image = cls(width, height)
    low, high = (0, 60000) if cls is ImageDepth16U else (0, 255)
    image.mutable_data[...] = np.random.default_rng(3).integers(low, high, image.shape)
    return image


EXACT = [
    (ImageRgba8U, "png"),
    (ImageRgb8U, "png"),
    (ImageGrey8U, "png"),
    (ImageDepth16U, "png"),
    (ImageRgba8U, "tiff"),
    (ImageRgb8U, "tif"),
    (ImageGrey8U, "tiff"),
    (ImageDepth16U, "tiff"),
    (ImageDepth32F, "tiff"),
]


@pytest.mark.parametrize(("cls", "extension"), EXACT)
def test_what_was_written_is_read(cls, extension, tmp_path):
    image, path = random_image(cls), tmp_path / f"image.{extension}"
    assert io.Save(image, path) is None
    again, about = io.Load(path), io.LoadMetadata(path)
    assert type(again) is cls and np.array_equal(again.data, image.data)
    assert (about.width, about.height, about.depth, about.channels) == (7, 5, 1, cls.Traits.kNumChannels)
    assert about.scalar is cls.Traits.kPixelScalar
    data = io.Save(image, about.format)
    assert np.array_equal(io.Load(data).data, image.data) and io.LoadMetadata(buffer=data).format is about.format


def test_depths_keep_infinity(tmp_path):
    image = ImageDepth32F(2, 1)
    image.mutable_data[0, :, 0] = np.inf, 0.25
    io.Save(image, tmp_path / "depth.tiff")
    assert io.Load(tmp_path / "depth.tiff").data[0, :, 0].tolist() == [np.inf, 0.25]


def test_files_know_less_than_images(tmp_path):
    for cls, plain in ((ImageBgr8U, ImageRgb8U), (ImageBgra8U, ImageRgba8U)):
        image = random_image(cls)
        again = io.Load(io.Save(image, ImageFileFormat.kPng))
        order = [2, 1, 0, 3][: again.shape[-1]]
        assert type(again) is plain and np.array_equal(again.data, image.data[..., order])
    labels = random_image(ImageLabel16I)
    again = io.Load(io.Save(labels, ImageFileFormat.kPng))
    assert type(again) is ImageDepth16U and np.array_equal(again.data, labels.data)
    flat = ImageRgba8U(16, 16, 100)
    again = io.Load(io.Save(flat, ImageFileFormat.kJpeg))
    assert type(again) is ImageRgb8U and np.abs(again.data.astype(int) - 100).max() <= 2


def test_format_goes_before_extension(tmp_path):
    image, path = random_image(ImageRgb8U), tmp_path / "image.dat"
    with pytest.raises(RuntimeError, match="does not imply any supported format"):
        io.Save(image, path)
    io.Save(image, path=path, format=ImageFileFormat.kPng)
    assert io.LoadMetadata(str(path)).format is ImageFileFormat.kPng
    with pytest.raises(RuntimeError, match=r"image\.dat"):
        io.Load(path, ImageFileFormat.kTiff)
    assert io.Load(path, format=ImageFileFormat.kPng).shape == image.shape


def test_what_cannot_be_written_or_read(tmp_path):
    for cls, format_ in (
        (ImageDepth32F, ImageFileFormat.kPng),
        (ImageDepth32F, ImageFileFormat.kJpeg),
        (ImageDepth16U, ImageFileFormat.kJpeg),
    ):
        with pytest.raises(RuntimeError, match=f"cannot hold an {cls.__name__}"):
            io.Save(random_image(cls), format_)
    with pytest.raises(RuntimeError, match="0 x 0 pixels"):
        io.Save(ImageRgb8U(), ImageFileFormat.kPng)
    with pytest.raises(RuntimeError, match="cannot write"):
        io.Save(random_image(ImageRgb8U), tmp_path / "none" / "image.png")
    with pytest.raises(RuntimeError, match=r"none\.png"):
        io.Load(tmp_path / "none.png")
    with pytest.raises(RuntimeError, match="buffer"):
        io.Load(b"nothing")
    assert io.LoadMetadata(b"nothing") is None and io.LoadMetadata(tmp_path / "none.png") is None
    for wrong in ((), (3, 4, 5)):
        with pytest.raises(TypeError):
            io.Load(*wrong)
    with pytest.raises(TypeError):
        io.Save("image", "path.png")
    assert ImageIo.Metadata().format is ImageFileFormat.kJpeg and ImageIo.Metadata(width=3).width == 3


def test_enumerations_count_as_drakes():
    assert [int(PixelType[name]) for name in ("kRgb8U", "kBgr8U", "kRgba8U", "kBgra8U")] == [0, 1, 2, 3]
    assert [int(PixelType[name]) for name in ("kGrey8U", "kDepth16U", "kDepth32F", "kLabel16I")] == [4, 5, 6, 7]
    assert int(PixelFormat.kLabel) == 6 and int(PixelScalar.k32F) == 3
    assert [int(f) for f in ImageFileFormat] == [0, 1, 2] and Image[PixelType.kGrey8U] is ImageGrey8U


# ---- ImageWriter


def write(tmp_path, ports, until=0.7):
    """Names of the files that a writer with these (pixel type, port name, format) leaves."""
    builder = DiagramBuilder()
    writer = builder.AddSystem(ImageWriter())
    for pixel, name, file_name in ports:
        port = writer.DeclareImageInputPort(pixel, name, str(tmp_path / file_name), 0.25, 0.1)
        source = builder.AddSystem(ConstantValueSource(AbstractValue.Make(random_image(Image[pixel]))))
        builder.Connect(source.get_output_port(), port)
    Simulator(builder.Build()).AdvanceTo(until)
    return writer, sorted(p.relative_to(tmp_path).as_posix() for p in tmp_path.rglob("*") if p.is_file())


def test_file_names_say_port_type_time_and_count(tmp_path):
    full = "{port_name}_{image_type}_{time_double:.3f}_{time_usec}_{time_msec}_{count:03}"
    kinds = {
        PixelType.kRgba8U: "color_0.350_350000_350_001.png",
        PixelType.kDepth32F: "depth_0.350_350000_350_001.tiff",
        PixelType.kDepth16U: "depth_0.350_350000_350_001.png",
        PixelType.kLabel16I: "label_0.350_350000_350_001.png",
        PixelType.kGrey8U: "grey_scale_0.350_350000_350_001.png",
    }
    _, names = write(tmp_path, [(pixel, pixel.name, full) for pixel in kinds])
    assert len(names) == 15 and set(names) >= {f"{pixel.name}_{name}" for pixel, name in kinds.items()}
    again = io.Load(tmp_path / f"kDepth32F_{kinds[PixelType.kDepth32F]}")
    assert np.array_equal(again.data, random_image(ImageDepth32F).data)


def test_extensions_folders_and_counts(tmp_path):
    (tmp_path / "cam_color").mkdir()
    ports = [
        (PixelType.kRgba8U, "cam", "{port_name}_{image_type}/{count}"),
        (PixelType.kRgba8U, "b", "same.png"),
        (PixelType.kRgba8U, "c", "odd.jpg"),
    ]
    writer, names = write(tmp_path, ports, until=0.4)
    assert names == ["cam_color/0.png", "cam_color/1.png", "odd.jpg.png", "same.png"]
    assert writer._counts == [2, 2, 2]
    writer.ResetAllImageCounts()
    assert writer._counts == [0, 0, 0]


def test_ports_that_could_not_write(tmp_path):
    writer = ImageWriter()
    good = (PixelType.kRgba8U, "p", str(tmp_path / "x"), 0.1, 0.0)
    for at, wrong, match in (
        (0, PixelType.kBgr8U, "does not support pixel_type"),
        (3, 0.0, "publish period must be positive"),
        (2, "", "cannot be empty"),
        (2, f"{tmp_path}/", "cannot end with a '/'"),
        (2, f"{tmp_path}/none/x", "the directory does not exist"),
        (2, f"{tmp_path}/{{count}}/x", "invalid directory.*count"),
        (2, f"{tmp_path}/{{number}}", r"unknown fields \['number'\]"),
    ):
        arguments = [*good[:at], wrong, *good[at + 1 :]]
        with pytest.raises(RuntimeError, match=match):
            writer.DeclareImageInputPort(*arguments)
    assert writer.num_input_ports() == 0
    assert writer.DeclareImageInputPort(*good).get_name() == "p"


@pytest.mark.parametrize("value", [300, -1])
def test_an_initial_value_must_fit_into_a_channel(value):
    from sheldrake.systems.sensors import ImageRgb8U

    with pytest.raises(TypeError, match=r"ImageRgb8U\(\): .*out of bounds for uint8"):
        ImageRgb8U(3, 2, value)
