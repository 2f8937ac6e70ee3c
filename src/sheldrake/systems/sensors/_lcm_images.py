"""Images to messages and back."""

from __future__ import annotations

import sys
import zlib
from typing import TYPE_CHECKING, Any

import numpy as np

from sheldrake.common._checked import checked
from sheldrake.common._kinds import flag, text
from sheldrake.common._overloads import overload, overloaded
from sheldrake.common.cpp_template import TemplateMethod
from sheldrake.common.value import AbstractValue
from sheldrake.geometry._image import (
    ConvertDepth16UTo32F,
    Image,
    ImageDepth16U,
    ImageDepth32F,
    ImageLabel16I,
    ImageRgba8U,
    PixelFormat,
    PixelScalar,
    PixelType,
)
from sheldrake.lcm._messages import lcmt_header, lcmt_image, lcmt_image_array
from sheldrake.systems.framework import InputPort, LeafSystem
from sheldrake.systems.framework._port_getters import input_port, output_port

if TYPE_CHECKING:
    from collections.abc import Callable

    from sheldrake.geometry._image import _Image
    from sheldrake.systems.framework import Context

_FORMATS = {
    PixelFormat.kGrey: lcmt_image.PIXEL_FORMAT_GRAY,
    PixelFormat.kRgb: lcmt_image.PIXEL_FORMAT_RGB,
    PixelFormat.kBgr: lcmt_image.PIXEL_FORMAT_BGR,
    PixelFormat.kRgba: lcmt_image.PIXEL_FORMAT_RGBA,
    PixelFormat.kBgra: lcmt_image.PIXEL_FORMAT_BGRA,
    PixelFormat.kDepth: lcmt_image.PIXEL_FORMAT_DEPTH,
    PixelFormat.kLabel: lcmt_image.PIXEL_FORMAT_LABEL,
}
_CHANNELS = {
    PixelScalar.k8U: lcmt_image.CHANNEL_TYPE_UINT8,
    PixelScalar.k16I: lcmt_image.CHANNEL_TYPE_INT16,
    PixelScalar.k16U: lcmt_image.CHANNEL_TYPE_UINT16,
    PixelScalar.k32F: lcmt_image.CHANNEL_TYPE_FLOAT32,
}
_BY_CODES = {
    (_FORMATS[Image[kind].Traits.kPixelFormat], _CHANNELS[Image[kind].Traits.kPixelScalar]): Image[kind]
    for kind in PixelType
}


def packed_image(image: Any, name: str, utime: int, compress: bool) -> lcmt_image:
    """The message of an image, taken at a time [us]."""
    pixels = np.ascontiguousarray(image.data)
    data = pixels.astype(pixels.dtype.newbyteorder("<")).tobytes()
    if compress:
        data = zlib.compress(data, 1)
    return lcmt_image(
        header=lcmt_header(utime=utime, frame_name=name),
        width=image.width(),
        height=image.height(),
        row_stride=pixels.strides[0],
        size=len(data),
        data=data,
        bigendian=False,
        pixel_format=_FORMATS[image.Traits.kPixelFormat],
        channel_type=_CHANNELS[image.Traits.kPixelScalar],
        compression_method=(
            lcmt_image.COMPRESSION_METHOD_ZLIB if compress else lcmt_image.COMPRESSION_METHOD_NOT_COMPRESSED
        ),
    )


def unpacked_image(message: Any) -> Any:
    """The image of an lcmt_image.

    Raises:
        RuntimeError: it has pixels or a compression that are not supported, or another number of them than it says.
    """
    cls = _BY_CODES.get((message.pixel_format, message.channel_type))
    if cls is None:
        raise RuntimeError(
            f"lcmt_image '{message.header.frame_name}': pixel_format {message.pixel_format} with channel_type "
            f"{message.channel_type} is not supported."
        )
    data = message.data
    if message.compression_method == lcmt_image.COMPRESSION_METHOD_ZLIB:
        data = zlib.decompress(data)
    elif message.compression_method != lcmt_image.COMPRESSION_METHOD_NOT_COMPRESSED:
        raise RuntimeError(
            f"lcmt_image '{message.header.frame_name}': compression_method {message.compression_method} is not "
            "supported; zlib (1) and none (0) are."
        )
    image = cls(message.width, message.height)
    dtype = image.data.dtype.newbyteorder(">" if message.bigendian else "<")
    found = np.frombuffer(data, dtype)
    if found.size != image.size():
        raise RuntimeError(
            f"lcmt_image '{message.header.frame_name}': {len(data)} bytes are not {message.width} x {message.height} "
            f"pixels of an {cls.__name__}."
        )
    image.mutable_data[...] = found.reshape(image.shape)
    return image


@checked
class ImageToLcmImageArrayT(LeafSystem):
    """Makes one message of the images at its input ports.

    Either `(do_compress=False)`, with ports by `DeclareImageInputPort[PixelType](name)`, or `(color_frame_name,
    depth_frame_name, label_frame_name, do_compress=False)` with three ports of these names for an ImageRgba8U, an
    ImageDepth32F and an ImageLabel16I.

    Args:
        do_compress: Whether pixels are compressed by zlib.
    """

    @overloaded(
        overload(do_compress=(flag, False)),
        overload(color_frame_name=text, depth_frame_name=text, label_frame_name=text, do_compress=(flag, False)),
    )
    def __init__(self, *given: Any):
        super().__init__()
        *names, self._compress = given
        for kind, name in zip((PixelType.kRgba8U, PixelType.kDepth32F, PixelType.kLabel16I), names):
            self._declare(kind, name)
        self.DeclareAbstractOutputPort("y0", lambda: AbstractValue.Make(lcmt_image_array()), self._calc)

    DeclareImageInputPort: Any

    def _declare(self, kind: PixelType, name: str) -> InputPort:
        return self.DeclareAbstractInputPort(name, AbstractValue.Make(Image[kind]()))

    color_image_input_port = input_port(0, "Takes colours, an ImageRgba8U.")
    depth_image_input_port = input_port(1, "Takes depths, an ImageDepth32F.")
    label_image_input_port = input_port(2, "Takes labels, an ImageLabel16I.")
    image_array_t_msg_output_port = output_port(0, "The message, an lcmt_image_array.")

    def _calc(self, context: Context, output: Any) -> None:
        utime = int(context.get_time() * 1e6)
        ports = [self.get_input_port(k) for k in range(self.num_input_ports())]
        images = [packed_image(port.Eval(context), port.get_name(), utime, self._compress) for port in ports]
        header = lcmt_header(utime=utime)
        output.set_value(lcmt_image_array(header=header, num_images=len(images), images=images))


def _declare_method(kind: PixelType) -> Callable[..., InputPort]:
    def DeclareImageInputPort(self: ImageToLcmImageArrayT, name: str) -> InputPort:
        """Adds an input port for images of this type."""
        return self._declare(kind, name)

    return DeclareImageInputPort


ImageToLcmImageArrayT.DeclareImageInputPort = TemplateMethod(
    "DeclareImageInputPort", ImageToLcmImageArrayT, scope=sys.modules[__name__]
)
for _kind in PixelType:
    ImageToLcmImageArrayT.DeclareImageInputPort.add_instantiation(_kind, _declare_method(_kind))


class LcmImageArrayToImages(LeafSystem):
    """Takes a message of images apart: the first with colours, depths (in metres) and labels; images without pixels
    where there is none.
    """

    def __init__(self) -> None:
        super().__init__()
        self.DeclareAbstractInputPort("image_array_t", AbstractValue.Make(lcmt_image_array()))
        self._declare("color_image", ImageRgba8U, self._color)
        self._declare("depth_image", ImageDepth32F, self._depth)
        self._declare("label_image", ImageLabel16I, lambda images: _first(images, ImageLabel16I))

    def _declare(self, name: str, kind: type, find: Any) -> None:
        def calc(context: Context, output: Any) -> None:
            images = [unpacked_image(message) for message in self.image_array_t_input_port().Eval(context).images]
            found = find(images)
            output.set_value(kind() if found is None else found)

        self.DeclareAbstractOutputPort(name, lambda: AbstractValue.Make(kind()), calc)

    @staticmethod
    def _color(images: list[Any]) -> _Image | None:
        coloured = (PixelFormat.kRgb, PixelFormat.kBgr, PixelFormat.kRgba, PixelFormat.kBgra)
        for image in images:
            if image.Traits.kPixelFormat in coloured:
                rgba = ImageRgba8U(image.width(), image.height(), 255)
                pixels = image.data
                if image.Traits.kPixelFormat in (PixelFormat.kBgr, PixelFormat.kBgra):
                    pixels = pixels[..., [2, 1, 0, 3][: pixels.shape[-1]]]
                rgba.mutable_data[..., : pixels.shape[-1]] = pixels
                return rgba
        return None

    @staticmethod
    def _depth(images: list[Any]) -> _Image | None:
        for image in images:
            if isinstance(image, ImageDepth32F):
                return image
            if isinstance(image, ImageDepth16U):
                metres = ImageDepth32F()
                ConvertDepth16UTo32F(image, metres)
                return metres
        return None

    image_array_t_input_port = input_port(0, "Takes an lcmt_image_array.")
    color_image_output_port = output_port(0, "Colours, an ImageRgba8U.")
    depth_image_output_port = output_port(1, "Depths in metres, an ImageDepth32F.")
    label_image_output_port = output_port(2, "Labels, an ImageLabel16I.")


def _first(images: list[Any], kind: type) -> Any:
    return next((image for image in images if isinstance(image, kind)), None)
