"""Systems that make colors of depths and labels, and one image of many."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from sheldrake.common._checked import checked
from sheldrake.common.value import AbstractValue
from sheldrake.geometry import RenderLabel, Rgba
from sheldrake.systems.framework import InputPort, LeafSystem
from sheldrake.systems.sensors import ImageDepth16U, ImageDepth32F, ImageLabel16I, ImageRgba8U

if TYPE_CHECKING:
    from sheldrake.geometry._image import _Image
    from sheldrake.systems.framework import Context

# Ten colors that are told apart easily: matplotlib's "tab10" cycle, from Tableau.
_PALETTE = np.array(
    [
        [31, 119, 180, 255],
        [255, 127, 14, 255],
        [44, 160, 44, 255],
        [214, 39, 40, 255],
        [148, 103, 189, 255],
        [140, 86, 75, 255],
        [227, 119, 194, 255],
        [127, 127, 127, 255],
        [188, 189, 34, 255],
        [23, 190, 207, 255],
    ],
    np.uint8,
)


def _bytes(rgba: Rgba) -> np.ndarray:
    return np.floor(255.0 * rgba.rgba + 1e-9).astype(np.uint8)


class ColorizeDepthImage(LeafSystem):
    """Makes a grey image of a depth image: what is nearest in it white, what is farthest black.

    Ports: inputs "depth_image_32f" and "depth_image_16u", of which one must be connected, output "color_image".
    Pixels without a depth have the `invalid_color`, by default a dark red.
    """

    def __init__(self) -> None:
        super().__init__()
        self.invalid_color = Rgba(100 / 255.0, 0.0, 0.0, 1.0)
        self.DeclareAbstractInputPort("depth_image_32f", AbstractValue.Make(ImageDepth32F()))
        self.DeclareAbstractInputPort("depth_image_16u", AbstractValue.Make(ImageDepth16U()))
        self.DeclareAbstractOutputPort("color_image", lambda: AbstractValue.Make(ImageRgba8U()), self._calc)

    @property
    def invalid_color(self) -> Rgba:
        """The color of pixels that are too near or too far, or have no depth."""
        return self._invalid_color

    @invalid_color.setter
    def invalid_color(self, value: Rgba) -> None:
        self._invalid_color = value.__copy__()

    def Calc(self, input: _Image, output: _Image) -> None:
        """Fills an image with the colors of a depth image.

        Raises:
            TypeError: when the images are of other types.
        """
        if not isinstance(input, (ImageDepth32F, ImageDepth16U)) or not isinstance(output, ImageRgba8U):
            raise TypeError(
                "ColorizeDepthImage.Calc(): expected an ImageDepth32F or ImageDepth16U and an ImageRgba8U, got "
                f"{type(input).__name__} and {type(output).__name__}."
            )
        raw = input.data[..., 0]
        valid = np.isfinite(raw) & (raw > 0)
        if isinstance(input, ImageDepth16U):
            valid &= raw < np.iinfo(np.uint16).max
        output.resize(input.width(), input.height())
        colors = output.mutable_data
        colors[...] = _bytes(self.invalid_color)
        if valid.any():
            depth = raw[valid].astype(float)
            nearest, farthest = depth.min(), depth.max()
            grey = 255.0 * (depth - nearest) / (farthest - nearest) if farthest > nearest else np.zeros_like(depth)
            colors[valid, :3] = (255.0 - np.floor(grey))[:, None].astype(np.uint8)
            colors[valid, 3] = 255

    def _calc(self, context: Context, output: AbstractValue) -> None:
        connected = [port for port in map(self.get_input_port, range(2)) if port.HasValue(context)]
        if len(connected) != 1:
            raise RuntimeError(
                f"ColorizeDepthImage '{self.GetSystemPathname()}': exactly one of the input ports 'depth_image_32f' "
                f"and 'depth_image_16u' must be connected, not {len(connected)}."
            )
        image = ImageRgba8U()
        self.Calc(connected[0].Eval(context), image)
        output.set_value(image)


class ColorizeLabelImage(LeafSystem):
    """Makes a color image of a label image: a color of ten for each label.

    Ports: input "label_image", output "color_image". Pixels without a label have the `background_color`, by default
    black that is transparent.
    """

    def __init__(self) -> None:
        super().__init__()
        self.background_color = Rgba(0.0, 0.0, 0.0, 0.0)
        self.DeclareAbstractInputPort("label_image", AbstractValue.Make(ImageLabel16I()))
        self.DeclareAbstractOutputPort("color_image", lambda: AbstractValue.Make(ImageRgba8U()), self._calc)

    @property
    def background_color(self) -> Rgba:
        """The color of pixels that have no label."""
        return self._background_color

    @background_color.setter
    def background_color(self, value: Rgba) -> None:
        self._background_color = value.__copy__()

    def Calc(self, input: _Image, output: _Image) -> None:
        """Fills an image with the colors of a label image.

        Raises:
            TypeError: when the images are of other types.
        """
        if not isinstance(input, ImageLabel16I) or not isinstance(output, ImageRgba8U):
            raise TypeError(
                "ColorizeLabelImage.Calc(): expected an ImageLabel16I and an ImageRgba8U, got "
                f"{type(input).__name__} and {type(output).__name__}."
            )
        labels = input.data[..., 0]
        output.resize(input.width(), input.height())
        output.mutable_data[...] = _PALETTE[labels.astype(np.uint16) % len(_PALETTE)]
        output.mutable_data[labels > RenderLabel.kMaxUnreserved] = _bytes(self.background_color)

    def _calc(self, context: Context, output: AbstractValue) -> None:
        image = ImageRgba8U()
        self.Calc(self.get_input_port().Eval(context), image)
        output.set_value(image)


@checked
class ConcatenateImages(LeafSystem):
    """Puts images side by side, in rows and columns.

    Ports: inputs "color_image_r0_c0" and so on, output "color_image". An image that is not connected has no size; gaps
    are transparent black.

    Args:
        rows: Number of rows.
        cols: Number of columns.

    Raises:
        ValueError: when there is no row or no column.
    """

    def __init__(self, *, rows: int = 1, cols: int = 1):
        super().__init__()
        if rows < 1 or cols < 1:
            raise ValueError(f"ConcatenateImages(): there must be a row and a column, got {rows} and {cols}.")
        self._rows, self._cols = rows, cols
        for row in range(rows):
            for col in range(cols):
                self.DeclareAbstractInputPort(f"color_image_r{row}_c{col}", AbstractValue.Make(ImageRgba8U()))
        self.DeclareAbstractOutputPort("color_image", lambda: AbstractValue.Make(ImageRgba8U()), self._calc)

    def get_input_port(self, *, row: int, col: int) -> InputPort:  # type: ignore[override]
        """Returns the input port of the image in a row and a column, counted from 0.

        Raises:
            ValueError: when there is no such row or column.
        """
        if not (0 <= row < self._rows and 0 <= col < self._cols):
            raise ValueError(
                f"ConcatenateImages.get_input_port(): row {row} and col {col} lie outside of {self._rows} x "
                f"{self._cols}."
            )
        return super().get_input_port(row * self._cols + col)

    def _calc(self, context: Context, output: AbstractValue) -> None:
        images = {}
        heights, widths = np.zeros(self._rows, int), np.zeros(self._cols, int)
        for row in range(self._rows):
            for col in range(self._cols):
                port = self.get_input_port(row=row, col=col)
                if port.HasValue(context):
                    data = images[row, col] = port.Eval(context).data
                    heights[row], widths[col] = max(heights[row], data.shape[0]), max(widths[col], data.shape[1])
        whole = ImageRgba8U(int(widths.sum()), int(heights.sum()))
        tops, lefts = np.cumsum(heights) - heights, np.cumsum(widths) - widths
        for (row, col), data in images.items():
            top, left = tops[row], lefts[col]
            whole.mutable_data[top : top + data.shape[0], left : left + data.shape[1]] = data
        output.set_value(whole)
