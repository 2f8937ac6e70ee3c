"""Images: arrays of pixels of one type.

What renderers fill and sensors give; `systems.sensors` shows them under Drake's names.
"""

from __future__ import annotations

import operator
import types
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np

from sheldrake.common._checked import checked
from sheldrake.common._enums import BoundEnum
from sheldrake.common._overloads import Mismatch
from sheldrake.common.cpp_template import TemplateClass
from sheldrake.common.value import _register_value_type

if TYPE_CHECKING:
    from typing_extensions import Self


class PixelFormat(BoundEnum):
    """What the channels of a pixel are."""

    kRgb, kBgr, kRgba, kBgra, kGrey, kDepth, kLabel = range(7)


class PixelScalar(BoundEnum):
    """The number a channel is."""

    k8U, k16I, k16U, k32F = range(4)


class PixelType(BoundEnum):
    """Format and number of a pixel."""

    kRgba8U, kRgb8U, kBgra8U, kBgr8U, kDepth16U, kDepth32F, kLabel16I, kGrey8U = 2, 0, 3, 1, 5, 6, 7, 4


_KINDS: dict[PixelType, tuple[PixelFormat, PixelScalar, int, type]] = {
    PixelType.kRgba8U: (PixelFormat.kRgba, PixelScalar.k8U, 4, np.uint8),
    PixelType.kRgb8U: (PixelFormat.kRgb, PixelScalar.k8U, 3, np.uint8),
    PixelType.kBgra8U: (PixelFormat.kBgra, PixelScalar.k8U, 4, np.uint8),
    PixelType.kBgr8U: (PixelFormat.kBgr, PixelScalar.k8U, 3, np.uint8),
    PixelType.kDepth16U: (PixelFormat.kDepth, PixelScalar.k16U, 1, np.uint16),
    PixelType.kDepth32F: (PixelFormat.kDepth, PixelScalar.k32F, 1, np.float32),
    PixelType.kLabel16I: (PixelFormat.kLabel, PixelScalar.k16I, 1, np.int16),
    PixelType.kGrey8U: (PixelFormat.kGrey, PixelScalar.k8U, 1, np.uint8),
}

_PUBLIC = types.ModuleType("sheldrake.systems.sensors")  # the home of these names, a floor above: only its name counts

ImageTraits = TemplateClass("ImageTraits", allow_default=False, scope=_PUBLIC)
Image = TemplateClass("Image", allow_default=False, scope=_PUBLIC)
ImageTraits.__doc__ = "What the pixels of an image are, by PixelType."
Image.__doc__ = "The class of images, by PixelType."


class _Image:
    """Pixels in rows, from the top left.

    Args:
        width: Width [pixels].
        height: Height [pixels]; both are zero or both positive.
        initial_value: Value of all channels.
    """

    Traits: ClassVar[Any]

    def __init__(self, width: int = 0, height: int = 0, initial_value: float = 0):
        self._data = np.empty((0, 0, self.Traits.kNumChannels), self.Traits.ChannelType)
        self.resize(width, height)
        try:
            self._data[...] = initial_value
        except OverflowError as error:
            raise Mismatch(f"{type(self).__name__}(): incompatible constructor arguments: {error}") from error

    def width(self) -> int:
        """Width [pixels]."""
        return self._data.shape[1]

    def height(self) -> int:
        """Height [pixels]."""
        return self._data.shape[0]

    def size(self) -> int:
        """Number of channel values: width times height times channels."""
        return self._data.size

    def resize(self, width: int, height: int) -> None:
        """Changes the size; all values are zero then."""
        if width < 0 or height < 0 or (width == 0) != (height == 0):
            raise RuntimeError(
                f"Image.resize(): width and height must be both positive or both zero, got {width} x {height}."
            )
        self._data = np.zeros((int(height), int(width), self.Traits.kNumChannels), self.Traits.ChannelType)

    def at(self, x: int, y: int) -> np.ndarray:
        """The channels of the pixel in column x and row y, a view."""
        x, y = operator.index(x), operator.index(y)
        if not (0 <= x < self.width() and 0 <= y < self.height()):
            raise RuntimeError(f"Image.at(): pixel ({x}, {y}) is outside of {self.width()} x {self.height()}.")
        return self._data[y, x]

    @property
    def shape(self) -> tuple:
        """(height, width, channels)."""
        return self._data.shape

    @property
    def data(self) -> np.ndarray:
        """The values, shape (height, width, channels), read-only."""
        view = self._data.view()
        view.flags.writeable = False
        return view

    @property
    def mutable_data(self) -> np.ndarray:
        """The values, shape (height, width, channels), to write through."""
        return self._data

    def __copy__(self) -> Self:
        copy = type(self)()
        copy._data = self._data.copy()
        return copy

    def __deepcopy__(self, memo: dict) -> Self:
        return self.__copy__()


def _make(pixel: PixelType) -> type[_Image]:
    format_, scalar, channels, number = _KINDS[pixel]
    traits = {"ChannelType": number, "kNumChannels": channels, "kPixelFormat": format_, "kPixelScalar": scalar}
    ImageTraits.add_instantiation(pixel, type("ImageTraits", (), {**traits, "__doc__": f"What {pixel.name} is."}))
    name = f"Image{pixel.name[1:]}"
    cls = type(
        name, (_Image,), {"Traits": ImageTraits[pixel], "__doc__": _Image.__doc__, "__module__": _PUBLIC.__name__}
    )
    Image.add_instantiation(pixel, cls, skip_rename=True)
    _register_value_type(cls)
    return cls


ImageRgba8U, ImageRgb8U = _make(PixelType.kRgba8U), _make(PixelType.kRgb8U)
ImageBgra8U, ImageBgr8U = _make(PixelType.kBgra8U), _make(PixelType.kBgr8U)
ImageDepth16U, ImageDepth32F = _make(PixelType.kDepth16U), _make(PixelType.kDepth32F)
ImageLabel16I, ImageGrey8U = _make(PixelType.kLabel16I), _make(PixelType.kGrey8U)

TOO_FAR, SCALE = 65535, 1000.0  # 16-bit depth is in millimetres; nothing measured: too close (0) or too far


@checked
def ConvertDepth32FTo16U(input: _Image, output: _Image) -> None:
    """Depth in metres to whole millimetres; NaN and what is beyond 65.534 m count as too far."""
    output.resize(input.width(), input.height())
    with np.errstate(invalid="ignore", over="ignore"):
        millimetres = input._data * np.float32(SCALE)
        near = np.nan_to_num(millimetres, nan=TOO_FAR, posinf=TOO_FAR)
    output._data[...] = np.clip(near, 0, TOO_FAR).astype(np.uint16)


@checked
def ConvertDepth16UTo32F(input: _Image, output: _Image) -> None:
    """Depth in whole millimetres to metres; too far is infinity."""
    output.resize(input.width(), input.height())
    metres = input._data.astype(np.float32) / np.float32(SCALE)
    output._data[...] = np.where(input._data == TOO_FAR, np.float32(np.inf), metres)


for _public in (PixelFormat, PixelScalar, PixelType, ConvertDepth32FTo16U, ConvertDepth16UTo32F):
    _public.__module__ = _PUBLIC.__name__
