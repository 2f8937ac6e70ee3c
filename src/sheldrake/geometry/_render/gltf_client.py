"""A render engine that asks a server for its pictures."""

from __future__ import annotations

import hashlib
import io
import logging
import os
import tempfile
import uuid
from typing import TYPE_CHECKING, Any

import numpy as np

from .camera import ColorRenderCamera, DepthRenderCamera, RenderCameraCore
from .engine import RenderEngine
from .gltf_scene import gltf_of
from .label import RenderLabel
from .raster_arrays import Item
from .raster_engine import RasterEngine
from .raster_shapes import Material

if TYPE_CHECKING:
    from sheldrake.geometry._image import _Image

log = logging.getLogger("drake")
NAME = "drake::geometry::render_gltf_client::internal::RenderEngineGltfClient"
_LENS = ("width", "height", "focal_x", "focal_y", "fov_x", "fov_y", "center_x", "center_y")
_TOO_FAR = 65535
_WHITE = (1.0, 1.0, 1.0, 1.0)


class GltfClientEngine(RasterEngine):
    """Sends scenes as glTF files to a server (the interface of Drake's render servers) and reads the images it answers.

    A request is a form of the fields scene, scene_sha256, image_type ("color", "depth", "label"), width, height, near,
    far, focal_x, focal_y, fov_x, fov_y, center_x, center_y, submit, and min_depth, max_depth for depths. An answer is
    a PNG of colours; depths [m] as TIFF, or [mm] as PNG of 16 bits; labels as a PNG of 16 bits or of colours with
    label = red + 256 green, as they are in the scene.
    """

    def DoClone(self) -> RenderEngine:
        return self._copy_to(GltfClientEngine(self._options))

    def DoRenderColorImage(self, camera: ColorRenderCamera, color_image_out: _Image) -> None:
        """Asks for colours."""
        pixels = self._ask("color", camera.core(), lambda item, material: (material.diffuse, material.texture))
        if pixels.ndim != 3:
            raise RuntimeError(f"RenderEngineGltfClient: {self._url()} sent a grey image for a color image.")
        color_image_out.mutable_data[...] = 255
        color_image_out.mutable_data[..., : pixels.shape[2]] = pixels

    def DoRenderDepthImage(self, camera: DepthRenderCamera, depth_image_out: _Image) -> None:
        """Asks for depths."""
        depths = {"min_depth": camera.depth_range().min_depth(), "max_depth": camera.depth_range().max_depth()}
        pixels = self._ask("depth", camera.core(), lambda item, material: (_WHITE, None), **depths)
        if pixels.ndim != 2:
            raise RuntimeError(f"RenderEngineGltfClient: {self._url()} sent a colored image for a depth image.")
        if pixels.dtype != np.float32:  # millimetres
            pixels = np.where(pixels == _TOO_FAR, np.inf, pixels / 1000.0)
        depth_image_out.mutable_data[..., 0] = pixels

    def DoRenderLabelImage(self, camera: ColorRenderCamera, label_image_out: _Image) -> None:
        """Asks for labels."""

        def look(item: Item, material: Material) -> Any:
            label = int(item.label)
            return ((label & 255) / 255.0, (label >> 8) / 255.0, 0.0, 1.0), None

        pixels = self._ask("label", camera.core(), look).astype(np.int64)
        label_image_out.mutable_data[..., 0] = pixels if pixels.ndim == 2 else pixels[..., 0] + 256 * pixels[..., 1]

    def _url(self) -> str:
        params = self._options.params
        return f"{params.base_url.rstrip('/')}/{params.render_endpoint.lstrip('/')}"

    def _ask(self, kind: str, core: RenderCameraCore, look: Any, **more: float) -> np.ndarray:
        """The server's picture of a kind.

        Raises:
            RuntimeError: there is no answer, or it is not such a picture.
        """
        shown = [
            (item, self._X_WG[i])
            for i, item in self._items.items()
            if kind != "label" or item.label != RenderLabel.kDoNotRender
        ]
        items, poses = [item for item, _ in shown], np.array([X for _, X in shown]).reshape(-1, 3, 4)
        scene = gltf_of(items, poses, core, self._X_WC, look)
        lens, clipping = core.intrinsics(), core.clipping()
        fields = {
            "scene_sha256": hashlib.sha256(scene).hexdigest(),
            "image_type": kind,
            **{name: getattr(lens, name)() for name in _LENS},
            **{name: getattr(clipping, name)() for name in ("near", "far")},
            **more,
            "submit": "Render",
        }
        answer = self._post(fields, scene, f"{kind}.gltf")
        self._keep(kind, scene, answer)
        return self._decoded(answer, kind, (lens.height(), lens.width()))

    def _post(self, fields: dict[str, Any], scene: bytes, name: str) -> bytes:
        import urllib.error  # not above: what draws elsewhere does not wait for them
        import urllib.request

        boundary = uuid.uuid4().hex
        request = urllib.request.Request(
            self._url(),
            data=_form(fields, scene, name, boundary),
            headers={"Content-Type": f"multipart/form-data; boundary={boundary}"},
        )
        if self._options.params.verbose:
            log.info("RenderEngineGltfClient: posting %d bytes to %s", len(scene), self._url())
        try:
            with urllib.request.urlopen(request) as answer:
                return answer.read()
        except urllib.error.HTTPError as error:
            said = error.read().decode(errors="replace")[:1000]
            raise RuntimeError(
                f"RenderEngineGltfClient: {self._url()} answered with the HTTP status {error.code}: {said}"
            ) from None
        except OSError as error:
            raise RuntimeError(f"RenderEngineGltfClient: no answer from {self._url()}: {error}") from None

    def _decoded(self, answer: bytes, kind: str, shape: tuple[int, int]) -> np.ndarray:
        import PIL.Image

        try:
            with PIL.Image.open(io.BytesIO(answer), formats=["PNG", "TIFF"]) as image:
                pixels = np.asarray(image)
        except (OSError, SyntaxError, ValueError) as error:
            raise RuntimeError(f"RenderEngineGltfClient: {self._url()} sent no PNG or TIFF image: {error}") from None
        if pixels.shape[:2] != shape:
            raise RuntimeError(
                f"RenderEngineGltfClient: {self._url()} sent a {kind} image of {pixels.shape[1]} x {pixels.shape[0]} "
                f"pixels, not {shape[1]} x {shape[0]}."
            )
        return pixels

    def _keep(self, kind: str, scene: bytes, answer: bytes) -> None:
        """Leaves what was exchanged in files, if that is wanted."""
        if not self._options.params.cleanup:
            folder = tempfile.mkdtemp(prefix="sheldrake-gltf-")
            for name, data in ((f"{kind}.gltf", scene), (f"{kind}.image", answer)):
                with open(os.path.join(folder, name), "wb") as file:
                    file.write(data)
            log.info("RenderEngineGltfClient: scene and image are in %s", folder)


def _form(fields: dict[str, Any], scene: bytes, name: str, boundary: str) -> bytes:
    """A form with a file, as multipart/form-data."""
    parts = [
        f'--{boundary}\r\nContent-Disposition: form-data; name="{field}"\r\n\r\n{value}\r\n'.encode()
        for field, value in fields.items()
    ]
    head = f'--{boundary}\r\nContent-Disposition: form-data; name="scene"; filename="{name}"\r\n'
    file = head.encode() + b"Content-Type: model/gltf+json\r\n\r\n" + scene
    return b"".join([*parts, file, f"\r\n--{boundary}--\r\n".encode()])
