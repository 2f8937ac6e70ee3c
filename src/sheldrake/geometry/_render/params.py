"""Options of render engines: colours, lights, and what only Drake's own engines can do."""

from __future__ import annotations

import numpy as np

from sheldrake.common._options import Options, Vector3, Vector4
from sheldrake.geometry._rgba import Rgba


class LightParameter(Options):
    """A light.

    Attributes:
        type: "directional", "point" or "spot".
        color: Its colour.
        attenuation_values: Of a point or spot light: it shines with intensity / (a0 + a1 d + a2 d^2) at distance d [m].
        position: Of a point or spot light, in `frame` [m], shape (3,).
        frame: "camera" (x right, y down, z forward) or "world".
        intensity: Factor of the colour.
        direction: Where a directional or spot light shines to, in `frame`, shape (3,).
        cone_angle: Between a spot light's axis and the edge of its cone [degrees].
    """

    type: str = "directional"
    color: Rgba = Rgba(1.0, 1.0, 1.0)
    attenuation_values: Vector3 = np.array([1.0, 0.0, 0.0])
    position: Vector3 = np.array([0.0, 0.0, 0.0])
    frame: str = "camera"
    intensity: float = 1.0
    direction: Vector3 = np.array([0.0, 0.0, 1.0])
    cone_angle: float = 0.0


class NullTexture(Options):
    """No texture."""


class EquirectangularMap(Options):
    """A picture of the surroundings, angles as rectangles.

    Attributes:
        path: The file.
    """

    path: str = ""


class EnvironmentMap(Options):
    """Surroundings that shine.

    Attributes:
        skybox: Whether they are seen.
        texture: What they are.
    """

    skybox: bool = True
    texture: NullTexture | EquirectangularMap = NullTexture()


class GltfExtension(Options):
    """What to do about an extension of glTF.

    Attributes:
        warn_unimplemented: Whether to warn of a file that uses it.
    """

    warn_unimplemented: bool = True


class SsaoParameter(Options):
    """Darkness in corners (screen-space ambient occlusion); see Drake's documentation of RenderEngineVtk.

    Attributes:
        radius: Of the neighbourhood that is looked at [m].
        bias: Least difference of depth that counts [m].
        sample_count: Samples a pixel.
        intensity_scale: Factor of the darkness.
        intensity_shift: Added to it.
        blur: Whether to blur it.
    """

    radius: float = 0.25
    bias: float = 0.01
    sample_count: int = 128
    intensity_scale: float = 1.0
    intensity_shift: float = 0.0
    blur: bool = True


def _known_extensions() -> dict[str, GltfExtension]:
    return {"KHR_texture_basisu": GltfExtension(warn_unimplemented=False)}


class RenderEngineVtkParams(Options):
    """Options of `MakeRenderEngineVtk()`.

    Attributes:
        default_diffuse: Colour (r, g, b, a) of geometry that names none; orange when None.
        default_clear_color: Colour (r, g, b) where there is nothing.
        lights: Lights; when empty, one that shines where the camera looks.
        environment_map: Not drawn.
        exposure: Not drawn.
        ssao: Not drawn.
        cast_shadows: Not drawn.
        shadow_map_size: Without shadows, nothing.
        force_to_pbr: Not drawn: all surfaces are matt.
        gltf_extensions: Of no influence.
        backend: Of no influence: no graphics library is used.
    """

    default_diffuse: Vector4 | None = None
    default_clear_color: Vector3 = np.array([204 / 255, 229 / 255, 1.0])
    lights: list[LightParameter] = []
    environment_map: EnvironmentMap | None = None
    exposure: float | None = None
    ssao: SsaoParameter | None = None
    cast_shadows: bool = False
    shadow_map_size: int = 256
    force_to_pbr: bool = False
    gltf_extensions: dict[str, GltfExtension] = _known_extensions()
    backend: str = ""


class RenderEngineGlParams(Options):
    """Options of `MakeRenderEngineGl()`.

    Attributes:
        default_diffuse: Colour of geometry that names none.
        default_clear_color: Colour where there is nothing.
        lights: Lights; when empty, one that shines where the camera looks.
        cast_shadows: Whether lights cast shadows; no engine here draws them.
        shadow_map_size: Size of a shadow map [pixels].
    """

    default_diffuse: Rgba = Rgba(0.9, 0.7, 0.2)
    default_clear_color: Rgba = Rgba(204 / 255, 229 / 255, 1.0)
    lights: list[LightParameter] = []
    cast_shadows: bool = False
    shadow_map_size: int = 256


class RenderEngineGltfClientParams(Options):
    """Options of a render engine that asks a server for pictures.

    Attributes:
        base_url: Address of the server.
        render_endpoint: Path on the server.
        verbose: Whether to log requests.
        cleanup: Whether to remove the files that were exchanged.
    """

    base_url: str = "http://127.0.0.1:8000"
    render_endpoint: str = "render"
    verbose: bool = False
    cleanup: bool = True
