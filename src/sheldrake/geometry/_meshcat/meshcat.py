"""Meshcat: a scene in a web page, with pydrake's calls.

Put together from parts, one file a subject, whose calls it shows; a call is documented there. One that draws changes
the tree of paths (`tree`) and returns; the hub sends what changed to the pages from a thread of its own, so that no
page can slow a simulation.
"""

from __future__ import annotations

import html
import logging
import os
import sys
import time
import weakref
from typing import Any, overload

import numpy as np

from sheldrake.common._parts import Call, part

from .camera import Cameras, OrthographicCamera, PerspectiveCamera
from .controls import Controls, Gamepad
from .hub import Hub, stop
from .objects import Objects, SideOfFaceToRender
from .params import MeshcatParams
from .placement import Placement
from .realtime import Realtime
from .recorder import Recorder
from .server import ALL_INTERFACES, open_socket

log = logging.getLogger("drake")


def _check_network_allowed() -> None:
    allowed = os.environ.get("DRAKE_ALLOW_NETWORK")
    if allowed and "meshcat" not in allowed.split(":"):
        raise RuntimeError(f"Meshcat(): not allowed by the environment variable DRAKE_ALLOW_NETWORK={allowed}.")


_objects = part(Objects, "_objects")
_placement = part(Placement, "_placement")
_cameras = part(Cameras, "_cameras")
_realtime = part(Realtime, "_realtime")
_controls = part(Controls, "_controls")
_recorder = part(Recorder, "_recorder")


class Meshcat:
    """A 3-D scene shown in any browser, at web_url().

    Paths name places in the scene: "/a/b" lies below "/a" and moves with it; a path that does not
    start with "/" lies below "/drake". The page listens on this machine only, unless
    MeshcatParams.host says otherwise. Calls only note what changed; pages are told from another
    thread, and only while somebody looks.

    Args:
        port: Port to listen on; None takes the first free one from 7000 on, 0 any free one.
        params: More choices, in place of `port`.

    Raises:
        RuntimeError: when the wanted port is in use.
        RuntimeError: when a parameter is out of range.
    """

    Gamepad = Gamepad
    OrthographicCamera = OrthographicCamera
    PerspectiveCamera = PerspectiveCamera
    SideOfFaceToRender = SideOfFaceToRender

    SetObject = Call(_objects.SetObject)
    SetTriangleMesh = Call(_objects.SetTriangleMesh)
    SetTriangleColorMesh = Call(_objects.SetTriangleColorMesh)
    PlotSurface = Call(_objects.PlotSurface)
    SetLine = Call(_objects.SetLine)
    SetLineSegments = Call(_objects.SetLineSegments)

    SetTransform = Call(_placement.SetTransform)
    SetProperty = Call(_placement.SetProperty)
    HasPath = Call(_placement.HasPath)
    Delete = Call(_placement.Delete)
    _set_poses = Call(_placement._set_poses)
    _set_scales = Call(_placement._set_scales)
    _set_properties = Call(_placement._set_properties)
    _defer = Call(_placement._defer)
    _note = Call(_placement._note)
    _extent = Call(_placement._extent)
    _lowest = Call(_placement._lowest)

    SetCamera = Call(_cameras.SetCamera)
    SetCameraPose = Call(_cameras.SetCameraPose)
    SetCameraTarget = Call(_cameras.SetCameraTarget)
    GetTrackedCameraPose = Call(_cameras.GetTrackedCameraPose)
    Set2dRenderMode = Call(_cameras.Set2dRenderMode)
    ResetRenderMode = Call(_cameras.ResetRenderMode)
    SetEnvironmentMap = Call(_cameras.SetEnvironmentMap)
    _newest_camera_pose = Call(_cameras._newest_camera_pose)
    _field_of_view = Call(_cameras._field_of_view)

    SetRealtimeRate = Call(_realtime.SetRealtimeRate)
    GetRealtimeRate = Call(_realtime.GetRealtimeRate)
    SetSimulationTime = Call(_realtime.SetSimulationTime)
    AddButton = Call(_controls.AddButton)
    GetButtonClicks = Call(_controls.GetButtonClicks)
    GetButtonNames = Call(_controls.GetButtonNames)
    DeleteButton = Call(_controls.DeleteButton)
    AddSlider = Call(_controls.AddSlider)
    GetSliderValue = Call(_controls.GetSliderValue)
    SetSliderValue = Call(_controls.SetSliderValue)
    GetSliderNames = Call(_controls.GetSliderNames)
    DeleteSlider = Call(_controls.DeleteSlider)
    DeleteAddedControls = Call(_controls.DeleteAddedControls)
    GetGamepad = Call(_controls.GetGamepad)

    StartRecording = Call(_recorder.StartRecording)
    StopRecording = Call(_recorder.StopRecording)
    PublishRecording = Call(_recorder.PublishRecording)
    DeleteRecording = Call(_recorder.DeleteRecording)
    get_mutable_recording = Call(_recorder.get_mutable_recording)
    SetAnimation = Call(_recorder.SetAnimation)
    StaticHtml = Call(_recorder.StaticHtml)
    StaticZip = Call(_recorder.StaticZip)
    _is_recording = Call(_recorder._is_recording)
    _has_published = Call(_recorder._has_published)

    @overload
    def __init__(self, port: int | None = None) -> None: ...
    @overload
    def __init__(self, params: MeshcatParams) -> None: ...
    def __init__(self, *args: Any, **kwargs: Any) -> None:
        params = self._params(*args, **kwargs)
        _check_network_allowed()
        if not params.realtime_rate_period > 0:
            raise RuntimeError(
                f"MeshcatParams: realtime_rate_period must be positive, got {params.realtime_rate_period}."
            )
        listener = open_socket(params.host, params.port)
        self._port = listener.getsockname()[1]
        host = "localhost" if params.host in ALL_INTERFACES else params.host
        try:
            self._web_url = params.web_url_pattern.format(host=host, port=self._port).rstrip("/")
        except (KeyError, IndexError, ValueError) as error:
            listener.close()
            raise RuntimeError(
                f"Meshcat(): web_url_pattern '{params.web_url_pattern}' names {error}; it has {{host}} and {{port}}."
            ) from None
        self._hub = hub = Hub(params, listener)
        self._grabs = hub.grabs
        self._objects, self._placement = Objects(hub.tree), Placement(hub)
        self._cameras = Cameras(hub, self._placement)
        self._realtime, self._controls = Realtime(hub.status, params.realtime_rate_period), hub.controls
        self._recorder = Recorder(hub)
        self._finalizer = weakref.finalize(self, stop, self._hub)
        for item in params.initial_properties:
            self.SetProperty(item.path, item.property, item.value)
        self._announce()

    @staticmethod
    def _params(*args: Any, **kwargs: Any) -> MeshcatParams:
        if len(args) + len(kwargs) > 1 or set(kwargs) - {"port", "params"}:
            raise TypeError(f"Meshcat(): expected (port) or (params), got {args} {kwargs}.")
        value = args[0] if args else next(iter(kwargs.values()), None)
        if isinstance(value, MeshcatParams):
            return value
        if value is not None and (isinstance(value, bool) or not isinstance(value, (int, np.integer))):
            raise TypeError(f"Meshcat(): expected a port number or MeshcatParams, got {type(value).__name__}.")
        return MeshcatParams(port=None if value is None else int(value))

    def _announce(self) -> None:
        text = f"Meshcat listening for connections at {self._web_url}"
        if log.isEnabledFor(logging.INFO) and log.hasHandlers():
            log.info(text)
        elif sys.stderr is not None:
            print(text, file=sys.stderr)

    def web_url(self) -> str:
        """Returns the address to open in a browser."""
        return self._web_url

    def port(self) -> int:
        """Returns the port."""
        return self._port

    def ws_url(self) -> str:
        """Returns the address of the websocket."""
        return "ws" + self._web_url.removeprefix("http")

    def GetNumActiveConnections(self) -> int:
        """Returns how many pages are connected."""
        return self._hub.page.num_clients()

    def _is_shown(self) -> bool:
        """Whether some page has drawn something of the scene."""
        return self._controls.is_shown

    def Flush(self) -> None:
        """Waits until every page has been sent what was set so far, at most 15 s for a page that does not take it."""
        self._hub.page.sync()
        server = self._hub.server._websock_server
        buffer = server._broadcast_buffer
        last = buffer.message_counter - 1
        deadline = time.monotonic() + 15.0
        server.flush()
        while time.monotonic() < deadline:
            cursors = list(buffer.generator_cursors.values())
            pending = any(c.transport.get_write_buffer_size() for c in list(server._live_connections.values()))
            if not pending and all(cursor >= last for cursor in cursors):
                return
            time.sleep(0.002)

    def _InjectWebsocketMessage(self, message: bytes) -> None:
        """Acts as if a page had sent a message in Meshcat's own format; for tests."""
        import msgspec

        try:
            self._controls.receive(msgspec.msgpack.decode(message))
        except (msgspec.MsgspecError, ValueError, TypeError, KeyError) as error:
            log.warning("Meshcat: a page sent something unreadable: %s", error)

    def _repr_html_(self) -> str:
        """Shows the page inside a notebook; once a recording is published, its replay, which stays when it is saved."""
        style = 'title="sheldrake scene" style="width:100%; height:480px; border:0"'
        if not self._has_published():
            return f'<iframe src="{self._web_url}" {style}></iframe>'
        replay = f'<iframe srcdoc="{html.escape(self.StaticHtml())}" {style}></iframe>'
        return f'{replay}<div><a href="{self._web_url}" target="_blank">the page</a> while the program runs</div>'


def StartMeshcat() -> Meshcat:
    """Returns a Meshcat on the first free port."""
    return Meshcat()
