"""Makes render engines. What draws is imported when the first engine is made: most programs take no pictures."""

from __future__ import annotations

import copy
import logging
import os
from typing import Any

from sheldrake.common._checked import checked
from sheldrake.geometry._rgba import Rgba

from .engine import RenderEngine
from .params import RenderEngineGlParams, RenderEngineGltfClientParams, RenderEngineVtkParams

log = logging.getLogger("drake")
_NETWORK = "DRAKE_ALLOW_NETWORK"

kHasRenderEngineVtk = kHasRenderEngineGl = kHasRenderEngineGltfClient = True
"""Whether there are engines of these kinds."""


@checked
def MakeRenderEngineVtk(params: RenderEngineVtkParams) -> RenderEngine:
    """A render engine with the colours and lights of Drake's VTK engine, drawn without a graphics library.

    Surfaces are matt (Lambert); shadows, environment maps, exposure and ambient occlusion are not drawn, of which a
    warning tells where `params` ask for them.

    Args:
        params: Options.

    Raises:
        RuntimeError: a light has an unknown type or frame.
    """
    _warn_of_what_is_not_drawn(
        "MakeRenderEngineVtk", params, ["environment_map", "exposure", "ssao", "cast_shadows", "force_to_pbr"]
    )
    diffuse = (0.9, 0.45, 0.1, 1.0) if params.default_diffuse is None else params.default_diffuse
    return _engine(
        "drake::geometry::render_vtk::internal::RenderEngineVtk", params, diffuse, Rgba(*params.default_clear_color)
    )


def MakeRenderEngineGl(params: RenderEngineGlParams | None = None) -> RenderEngine:
    """A render engine with the colours of Drake's OpenGL engine, drawn without a graphics library.

    Shadows are not drawn, of which a warning tells where `params` ask for them.

    Args:
        params: Options.

    Raises:
        RuntimeError: a light has an unknown type or frame.
    """
    params = RenderEngineGlParams() if params is None else params
    _warn_of_what_is_not_drawn("MakeRenderEngineGl", params, ["cast_shadows"])
    return _engine(
        "drake::geometry::render_gl::internal::RenderEngineGl",
        params,
        params.default_diffuse.rgba,
        params.default_clear_color,
    )


def _warn_of_what_is_not_drawn(call: str, params: Any, names: list[str]) -> None:
    ignored = [name for name in names if getattr(params, name)]
    if ignored:
        log.warning("%s(): not drawn here: %s.", call, ", ".join(ignored))


def _engine(name: str, params: Any, diffuse: Any, background: Rgba) -> RenderEngine:
    from .raster_engine import EngineOptions, RasterEngine

    kept = copy.deepcopy(params)
    return RasterEngine(EngineOptions(name, kept, tuple(float(x) for x in diffuse), background, tuple(kept.lights)))


def MakeRenderEngineGltfClient(params: RenderEngineGltfClientParams | None = None) -> RenderEngine:
    """A render engine that sends scenes as glTF files to a server of pictures, for example one with Blender.

    Args:
        params: Where the server is.

    Raises:
        RuntimeError: the environment variable DRAKE_ALLOW_NETWORK is set and does not name "render_gltf_client".
    """
    allowed = os.environ.get(_NETWORK, "")
    if allowed and "render_gltf_client" not in allowed.split(":"):
        raise RuntimeError(f"RenderEngineGltfClient has been disabled via the {_NETWORK} environment variable")
    from .gltf_client import NAME, GltfClientEngine
    from .raster_engine import EngineOptions

    params = RenderEngineGltfClientParams() if params is None else params
    return GltfClientEngine(EngineOptions(NAME, copy.copy(params), (0.9, 0.45, 0.1, 1.0), Rgba(), ()))
