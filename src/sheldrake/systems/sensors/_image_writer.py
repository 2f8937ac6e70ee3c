"""ImageWriter: the images of a simulation into files."""

from __future__ import annotations

import string
from pathlib import Path
from typing import TYPE_CHECKING

from sheldrake.common._checked import checked
from sheldrake.common.value import AbstractValue
from sheldrake.geometry._image import Image, PixelType
from sheldrake.systems.framework import InputPort, LeafSystem

from ._image_io import ImageIo

if TYPE_CHECKING:
    from sheldrake.systems.framework import Context

_KINDS = {  # name of the image type, extension
    PixelType.kRgba8U: ("color", ".png"),
    PixelType.kDepth32F: ("depth", ".tiff"),
    PixelType.kDepth16U: ("depth", ".png"),
    PixelType.kLabel16I: ("label", ".png"),
    PixelType.kGrey8U: ("grey_scale", ".png"),
}
_OF_PORT = ("port_name", "image_type")
_OF_IMAGE = ("time_double", "time_usec", "time_msec", "count")


@checked
class ImageWriter(LeafSystem):
    """Writes the images at its input ports, which `DeclareImageInputPort()` makes, into files, periodically."""

    def __init__(self) -> None:
        super().__init__()
        self._counts: list[int] = []

    def DeclareImageInputPort(
        self, pixel_type: PixelType, port_name: str, file_name_format: str, publish_period: float, start_time: float
    ) -> InputPort:
        """Adds an input port for images of one type.

        Args:
            pixel_type: kRgba8U, kDepth32F, kDepth16U, kLabel16I or kGrey8U.
            port_name: Name of the port.
            file_name_format: Path of the files, with "{port_name}", "{image_type}" ("color", "depth", "label",
                "grey_scale"), and, not in the folder, "{time_double}" [s], "{time_usec}", "{time_msec}", "{count}",
                with Python's formats: "{count:03}". The extension, ".png" or ".tiff", is added where it is missing.
            publish_period: Between two files [s].
            start_time: Time of the first [s].

        Raises:
            RuntimeError: another type; a period that is not positive; a folder that does not exist; no such field.
        """
        if pixel_type not in _KINDS:
            raise RuntimeError(
                f"ImageWriter.DeclareImageInputPort() does not support pixel_type={pixel_type}; it supports "
                f"{', '.join(kind.name for kind in _KINDS)}."
            )
        if not publish_period > 0.0:
            raise RuntimeError(f"ImageWriter: publish period must be positive, got {publish_period} s.")
        image_type, extension = _KINDS[pixel_type]
        _check(file_name_format, {"port_name": port_name, "image_type": image_type})
        if not file_name_format.endswith(extension):
            file_name_format += extension
        port = self.DeclareAbstractInputPort(port_name, AbstractValue.Make(Image[pixel_type]()))
        index = len(self._counts)
        self._counts.append(0)

        def publish(context: Context) -> None:
            time = float(context.get_time())
            path = file_name_format.format(
                port_name=port_name,
                image_type=image_type,
                time_double=time,
                time_usec=int(time * 1e6 + 0.5),
                time_msec=int(time * 1e3 + 0.5),
                count=self._counts[index],
            )
            ImageIo().Save(self.get_input_port(index).Eval(context), path)
            self._counts[index] += 1

        self.DeclarePeriodicPublishEvent(publish_period, start_time, publish)
        return port

    def ResetAllImageCounts(self) -> None:
        """Lets "{count}" of all ports start at zero again."""
        self._counts = [0] * len(self._counts)


def _check(file_name_format: str, of_port: dict[str, str]) -> None:
    """Raises RuntimeError unless files of this name can be written."""
    if not file_name_format:
        raise RuntimeError("ImageWriter: The file_name_format cannot be empty")
    if file_name_format.endswith("/"):
        raise RuntimeError(f"ImageWriter: The file_name_format '{file_name_format}' cannot end with a '/'")
    folder = file_name_format.rpartition("/")[0]
    in_folder, everywhere = _fields(folder), _fields(file_name_format)
    unknown = sorted(everywhere - {*_OF_PORT, *_OF_IMAGE})
    if unknown:
        raise RuntimeError(
            f"ImageWriter: The format string `{file_name_format}` has unknown fields {unknown}; there are "
            f"{', '.join((*_OF_PORT, *_OF_IMAGE))}."
        )
    late = sorted(in_folder - set(_OF_PORT))
    if late:
        raise RuntimeError(
            f"ImageWriter: The format string `{file_name_format}` implied an invalid directory: it cannot depend on "
            f"{', '.join(late)}, which change from image to image."
        )
    directory = Path(folder.format(**of_port) or ("/" if file_name_format.startswith("/") else "."))
    if not directory.is_dir():
        fault = "the directory does not exist" if not directory.exists() else "it is not a directory"
        raise RuntimeError(
            f"ImageWriter: The format string `{file_name_format}` implied the invalid directory: '{directory}'; {fault}"
        )


def _fields(text: str) -> set[str]:
    return {name for _, name, _, _ in string.Formatter().parse(text) if name is not None}
