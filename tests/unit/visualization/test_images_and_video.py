"""Colors of depths and labels, images side by side, films; level sets of expressions."""

import functools

import numpy as np
import pytest

from sheldrake.common.value import AbstractValue
from sheldrake.geometry import Rgba
from sheldrake.symbolic import Variable
from sheldrake.systems.analysis import Simulator
from sheldrake.systems.framework import DiagramBuilder, LeafSystem
from sheldrake.systems.sensors import ImageDepth16U, ImageDepth32F, ImageLabel16I, ImageRgba8U
from sheldrake.visualization import (
    ColorizeDepthImage,
    ColorizeLabelImage,
    ConcatenateImages,
    VideoWriter,
    plot_sublevelset_expression,
    plot_sublevelset_quadratic,
)


def image(cls, rows):
    rows = np.asarray(rows)
    new = cls(rows.shape[1], rows.shape[0])
    new.mutable_data[...] = rows.reshape(*rows.shape[:2], -1)
    return new


@pytest.mark.parametrize("cls", [ImageDepth32F, ImageDepth16U])
def test_near_is_white_and_far_is_black(cls):
    far = np.inf if cls is ImageDepth32F else 65535
    system, out = ColorizeDepthImage(), ImageRgba8U(1, 1)
    system.Calc(image(cls, [[1, 2, 3], [0, far, 1]]), out)
    assert out.data[0].tolist() == [[255] * 4, [128, 128, 128, 255], [0, 0, 0, 255]]
    assert out.data[1].tolist() == [[100, 0, 0, 255], [100, 0, 0, 255], [255] * 4]
    system.invalid_color = Rgba(0, 1, 0, 0.5)
    system.Calc(image(cls, [[0, 7]]), out)
    assert out.data[0].tolist() == [[0, 255, 0, 127], [255] * 4]


def test_one_depth_port_and_only_one():
    system = ColorizeDepthImage()
    context = system.CreateDefaultContext()
    with pytest.raises(RuntimeError, match="exactly one of the input ports"):
        system.get_output_port().Eval(context)
    system.GetInputPort("depth_image_16u").FixValue(context, image(ImageDepth16U, [[1, 2]]))
    assert system.get_output_port().Eval(context).data[0, :, 0].tolist() == [255, 0]
    with pytest.raises(TypeError, match="got ImageRgba8U and ImageRgba8U"):
        system.Calc(ImageRgba8U(), ImageRgba8U())


def test_labels_have_colors_and_no_label_has_none():
    system, out = ColorizeLabelImage(), ImageRgba8U()
    system.Calc(image(ImageLabel16I, [[0, 1, 10, 32767, 32764]]), out)
    blue, orange, again, empty, unspecified = out.data[0].tolist()
    assert blue == again != orange and blue[3] == 255
    assert empty == unspecified == [0, 0, 0, 0]
    system.background_color = Rgba(1, 0, 0, 1)
    context = system.CreateDefaultContext()
    system.get_input_port().FixValue(context, image(ImageLabel16I, [[32767]]))
    assert system.get_output_port().Eval(context).data.ravel().tolist() == [255, 0, 0, 255]
    with pytest.raises(TypeError, match="expected an ImageLabel16I"):
        system.Calc(ImageRgba8U(), out)


def test_images_side_by_side():
    system = ConcatenateImages(rows=2, cols=3)
    context = system.CreateDefaultContext()
    assert system.get_output_port().Eval(context).data.shape == (0, 0, 4)
    for (row, col), (height, width) in {(0, 0): (1, 2), (0, 1): (2, 1), (1, 1): (1, 3)}.items():
        pixels = np.full((height, width, 4), 1 + row + col)
        system.get_input_port(row=row, col=col).FixValue(context, image(ImageRgba8U, pixels))
    expected = [[1, 1, 2, 0, 0], [0, 0, 2, 0, 0], [0, 0, 3, 3, 3]]
    assert system.get_output_port().Eval(context).data[..., 3].tolist() == expected
    with pytest.raises(ValueError, match="row 2 and col 0 lie outside of 2 x 3"):
        system.get_input_port(row=2, col=0)
    with pytest.raises(ValueError, match="must be a row and a column"):
        ConcatenateImages(rows=0)


class Camera(LeafSystem):
    """Images that get brighter."""

    def __init__(self):
        super().__init__()
        kinds = {"color_image": ImageRgba8U, "label_image": ImageLabel16I, "depth_image_32f": ImageDepth32F}
        for name, cls in kinds.items():
            calc = functools.partial(self.calc, cls=cls)
            self.DeclareAbstractOutputPort(name, lambda cls=cls: AbstractValue.Make(cls()), calc)

    def calc(self, context, output, cls):
        output.set_value(image(cls, np.full((8, 16, cls.Traits.kNumChannels), int(200 * context.get_time()) + 1)))


@pytest.mark.parametrize(("kinds", "width"), [(None, 16), (["color", "label", "depth"], 48)])
def test_a_film_has_a_picture_for_each_period(tmp_path, kinds, width):
    from PIL import Image

    builder = DiagramBuilder()
    camera = builder.AddSystem(Camera())
    writer = builder.AddSystem(VideoWriter(filename=tmp_path / "film.gif", fps=8))
    writer.ConnectRgbdSensor(builder=builder, sensor=camera, kinds=kinds)
    simulator = Simulator(builder.Build())
    writer.Save()
    assert not (tmp_path / "film.gif").exists()
    simulator.AdvanceTo(1.0)
    writer.Save()
    with Image.open(tmp_path / "film.gif") as film:
        assert (film.n_frames, film.size) == (9, (width, 8))
        assert film.info["duration"] == pytest.approx(125, abs=5), "whole hundredths of seconds"


def test_errors_of_video_writers(tmp_path):
    with pytest.raises(RuntimeError, match="Invalid backend='foo'"):
        VideoWriter(filename="x.gif", backend="foo")
    with pytest.raises(ValueError, match="fps must be positive"):
        VideoWriter(filename="x.gif", fps=0)
    with pytest.raises(ValueError, match=r"kinds must be of \['color', 'label', 'depth'\], got \['heat'\]"):
        VideoWriter(filename="x.gif").ConnectRgbdSensor(builder=DiagramBuilder(), sensor=Camera(), kinds=["heat"])


class Axes:
    """Keeps what is filled."""

    def fill(self, x, y, **kwargs):
        self.x, self.y, self.kwargs = np.array(x), np.array(y), kwargs
        return [self]


def test_the_boundary_of_a_level_set():
    x, y, axes = Variable("x"), Variable("y"), Axes()
    assert plot_sublevelset_expression(axes, x**2 + x * y + y**2 + y**4 + 0.1 * x, 13, facecolor="r") == [axes]
    assert axes.x**2 + axes.x * axes.y + axes.y**2 + axes.y**4 + 0.1 * axes.x == pytest.approx(np.ones(13), abs=1e-9)
    assert len(set(np.round(np.arctan2(axes.y, axes.x), 6))) == 12 and axes.kwargs == {"facecolor": "r"}


def test_quadratic_expressions_are_ellipses_also_away_from_the_origin():
    x, y, one, other = Variable("x"), Variable("y"), Axes(), Axes()
    plot_sublevelset_expression(one, (x - 3) ** 2 + x * y + 2 * y**2 - 5)
    plot_sublevelset_quadratic(other, [[1, 0.5], [0.5, 2]], [-6, 0], 4)
    assert one.x == pytest.approx(other.x) and one.y == pytest.approx(other.y)


def test_sets_that_cannot_be_drawn():
    x, y = Variable("x"), Variable("y")
    for wrong, message in ((x**2, "two variables, got 1"), (x**4 + y**4 + 3, "origin"), (x**3 + y**4, "no end"),
                           (x**2 + y**2 + 3, "empty"), (x**2 - y**2, "positive definite")):  # fmt: skip
        with pytest.raises(ValueError, match=message):
            plot_sublevelset_expression(Axes(), wrong)
