"""ImageIo: images to files and bytes, and back."""

from __future__ import annotations

import io
import os
from pathlib import Path
from typing import Any, ClassVar

import numpy as np

from sheldrake.common._enums import BoundEnum
from sheldrake.common._kinds import instance_of
from sheldrake.common._options import Options
from sheldrake.common._overloads import Mismatch, kind, overload, overloaded
from sheldrake.geometry._image import (
    ImageDepth16U,
    ImageDepth32F,
    ImageGrey8U,
    ImageRgb8U,
    ImageRgba8U,
    PixelFormat,
    PixelScalar,
)


class ImageFileFormat(BoundEnum):
    """Formats of image files."""

    kJpeg, kPng, kTiff = range(3)


_NAMES = {ImageFileFormat.kJpeg: "JPEG", ImageFileFormat.kPng: "PNG", ImageFileFormat.kTiff: "TIFF"}
_FORMATS = {name: format_ for format_, name in _NAMES.items()}
_EXTENSIONS = {
    ".jpg": ImageFileFormat.kJpeg,
    ".jpeg": ImageFileFormat.kJpeg,
    ".png": ImageFileFormat.kPng,
    ".tif": ImageFileFormat.kTiff,
    ".tiff": ImageFileFormat.kTiff,
}
_WRITABLE = {
    ImageFileFormat.kJpeg: (PixelScalar.k8U,),
    ImageFileFormat.kPng: (PixelScalar.k8U, PixelScalar.k16U, PixelScalar.k16I),
    ImageFileFormat.kTiff: tuple(PixelScalar),
}
# Pillow's modes: image, scalar, channels, type of NumPy.
_MODES: dict[str, tuple[Any, PixelScalar, int, type]] = {
    "RGBA": (ImageRgba8U, PixelScalar.k8U, 4, np.uint8),
    "RGB": (ImageRgb8U, PixelScalar.k8U, 3, np.uint8),
    "L": (ImageGrey8U, PixelScalar.k8U, 1, np.uint8),
    "I;16": (ImageDepth16U, PixelScalar.k16U, 1, np.uint16),
    "I;16B": (ImageDepth16U, PixelScalar.k16U, 1, np.uint16),
    "I": (ImageDepth16U, PixelScalar.k16U, 1, np.uint16),
    "F": (ImageDepth32F, PixelScalar.k32F, 1, np.float32),
}


class Metadata(Options):
    """What a file says about its image.

    Attributes:
        format: Of the file.
        width: Width [pixels].
        height: Height [pixels].
        depth: 1: images are flat.
        channels: Channels a pixel.
        scalar: The number a channel is.
    """

    format: ImageFileFormat = ImageFileFormat.kJpeg
    width: int = 0
    height: int = 0
    depth: int = 0
    channels: int = 0
    scalar: PixelScalar = PixelScalar.k8U


@kind("Image")
def _image(value: Any) -> Any:
    if not hasattr(value, "Traits"):
        raise Mismatch
    return value


_PATH, _BUFFER = instance_of(str, os.PathLike), instance_of(bytes, bytearray)
_FORMAT = instance_of(ImageFileFormat, type(None))


class ImageIo:
    """Writes and reads image files: PNG for colours, labels and depths in millimetres, TIFF for those and depths in
    metres, JPEG for colours and greys.

    A file knows less than an image: BGR becomes RGB, labels become ImageDepth16U, and JPEG loses opacity and detail.
    """

    Metadata: ClassVar[type] = Metadata

    @overloaded(
        overload(image=_image, path=_PATH, format=(_FORMAT, None)),
        overload(
            lambda self, image, format: _encoded(image, format), image=_image, format=instance_of(ImageFileFormat)
        ),
    )
    def Save(self, image: Any, path: str | os.PathLike, format: ImageFileFormat | None) -> None:
        """Writes an image: `(image, path, format=None)` into a file, `(image, format)` as bytes, which are returned.

        Without a format the path's extension says it.

        Raises:
            RuntimeError: no format, or one that cannot hold the image, or the file cannot be written.
        """
        data = _encoded(image, _format_of(path, "Save") if format is None else format)
        try:
            Path(path).write_bytes(data)
        except OSError as error:
            raise RuntimeError(f"ImageIo.Save(path='{os.fspath(path)}'): cannot write: {error.strerror}.") from None

    @overloaded(overload(path=_PATH, format=(_FORMAT, None)), overload(buffer=_BUFFER, format=(_FORMAT, None)))
    def Load(self, source: str | os.PathLike | bytes, format: ImageFileFormat | None) -> Any:
        """Reads an image: `(path, format=None)` or `(buffer, format=None)`.

        Returns:
            An ImageRgba8U, ImageRgb8U, ImageGrey8U, ImageDepth16U or ImageDepth32F.

        Raises:
            RuntimeError: it cannot be read, or has another format than the one given.
        """
        picture, found = _opened(source, format)
        if picture is None:
            name = "buffer" if isinstance(source, (bytes, bytearray)) else os.fspath(source)
            raise RuntimeError(f"ImageIo.Load(): {name}: {found}")
        cls, _, channels, dtype = _MODES[picture.mode]
        image = cls(picture.width, picture.height)
        image.mutable_data[...] = np.asarray(picture).astype(dtype).reshape(picture.height, picture.width, channels)
        return image

    @overloaded(overload(path=_PATH), overload(buffer=_BUFFER))
    def LoadMetadata(self, source: str | os.PathLike | bytes) -> Any:
        """What `(path)` or `(buffer)` says about its image, an ImageIo.Metadata; None when it cannot be read."""
        picture, _ = _opened(source, None)
        if picture is None:
            return None
        _, scalar, channels, _ = _MODES[picture.mode]
        width, height = picture.size
        kind = _FORMATS[picture.format]
        return Metadata(format=kind, width=width, height=height, depth=1, channels=channels, scalar=scalar)


def _format_of(path: str | os.PathLike, call: str) -> ImageFileFormat:
    extension = Path(path).suffix.lower()
    if extension not in _EXTENSIONS:
        raise RuntimeError(
            f"ImageIo.{call}(path='{os.fspath(path)}'): the path does not imply any supported format; give one, or use "
            f"one of the extensions {', '.join(_EXTENSIONS)}."
        )
    return _EXTENSIONS[extension]


def _encoded(image: Any, format_: ImageFileFormat) -> bytes:
    import PIL.Image

    traits, pixels = image.Traits, image.data
    if traits.kPixelScalar not in _WRITABLE[format_] or pixels.size == 0:
        raise RuntimeError(
            f"ImageIo.Save(): a {_NAMES[format_]} file cannot hold an {type(image).__name__} of {image.width()} x "
            f"{image.height()} pixels."
        )
    if traits.kPixelFormat in (PixelFormat.kBgr, PixelFormat.kBgra):
        pixels = pixels[..., [2, 1, 0, 3][: pixels.shape[-1]]]
    if traits.kPixelScalar is PixelScalar.k16I:
        pixels = pixels.astype(np.uint16)
    if format_ is ImageFileFormat.kJpeg:
        pixels = pixels[..., :3]
    array = pixels[..., 0] if pixels.shape[-1] == 1 else pixels
    stream = io.BytesIO()
    PIL.Image.fromarray(np.ascontiguousarray(array)).save(stream, format=_NAMES[format_])
    return stream.getvalue()


def _opened(source: str | os.PathLike | bytes, format_: ImageFileFormat | None) -> tuple[Any, str]:
    """Pillow's image, or None and why there is none."""
    import PIL.Image

    formats = list(_FORMATS) if format_ is None else [_NAMES[format_]]
    try:
        file: Any = io.BytesIO(source) if isinstance(source, (bytes, bytearray)) else source
        picture = PIL.Image.open(file, formats=formats)
        picture.load()
    except (OSError, SyntaxError, ValueError, PIL.Image.DecompressionBombError) as error:
        return None, str(error)
    if picture.mode not in _MODES:
        return None, f"pixels of Pillow's mode {picture.mode} are not supported."
    return picture, ""
