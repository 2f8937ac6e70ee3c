"""Meshcat's calls, seen from Python and from a bare websocket client."""

import gc
import html
import re
import socket
import subprocess
import sys
import threading
import time
import urllib.error
import urllib.request
import weakref

import msgspec
import numpy as np
import pytest
import viser
from websockets.exceptions import ConnectionClosed, InvalidStatus
from websockets.sync.client import connect

from sheldrake.geometry import (
    Box,
    HalfSpace,
    Mesh,
    Meshcat,
    MeshcatAnimation,
    MeshcatParams,
    Rgba,
    Sphere,
)
from sheldrake.geometry._meshcat.stage import viewpoint
from sheldrake.math import RigidTransform


class Pose:
    """What Meshcat asks of a RigidTransform."""

    def __init__(self, p, R=None):
        self._X = np.hstack([np.eye(3) if R is None else R, np.reshape(p, (3, 1))])

    def GetAsMatrix34(self):
        return self._X


def join(meshcat, **options):
    """Connects as a page does."""
    return connect(f"ws://localhost:{meshcat.port()}", subprotocols=[f"viser-v{viser.__version__}"], **options)


def wait_until(condition, seconds=240.0):
    deadline = time.monotonic() + seconds
    while not condition():
        assert time.monotonic() < deadline, "never happened"
        time.sleep(0.01)


def test_ports_are_taken_in_turn_and_said():
    first, second = Meshcat(), Meshcat()
    assert 7000 <= first.port() < second.port() <= 7999
    assert first.web_url() == f"http://localhost:{first.port()}"
    assert first.ws_url() == f"ws://localhost:{first.port()}"


def test_explicit_busy_port_is_an_error(meshcat):
    with pytest.raises(RuntimeError, match=f"port {meshcat.port()} on host 'localhost' is in use"):
        Meshcat(port=meshcat.port())
    with pytest.raises(RuntimeError, match="in use"):
        Meshcat(MeshcatParams(port=meshcat.port()))


@pytest.mark.parametrize("port", [80, 1023, 65536, -1])
def test_port_out_of_range(port):
    with pytest.raises(RuntimeError, match=r"port must be 0 or from 1024 to 65535"):
        Meshcat(port=port)


def test_unknown_host():
    with pytest.raises(RuntimeError, match=r"cannot listen on host 'no-such-host\.invalid'"):
        Meshcat(MeshcatParams(host="no-such-host.invalid"))


def test_web_url_pattern():
    meshcat = Meshcat(MeshcatParams(port=0, web_url_pattern="https://robots.example/{port}/x"))
    assert meshcat.web_url() == f"https://robots.example/{meshcat.port()}/x"
    assert meshcat.ws_url() == f"wss://robots.example/{meshcat.port()}/x"
    with pytest.raises(RuntimeError, match="web_url_pattern"):
        Meshcat(MeshcatParams(port=0, web_url_pattern="http://{nothing}"))


def test_only_this_machine_is_let_in_by_default(meshcat):
    """The socket is bound to loopback: another address of this machine is refused."""
    own = socket.gethostbyname(socket.gethostname())
    if own.startswith("127."):
        own = "127.0.0.2"  # Linux routes all of 127/8 to this machine
    with pytest.raises(OSError):
        socket.create_connection((own, meshcat.port()), timeout=2).close()


def test_network_may_be_forbidden(monkeypatch):
    monkeypatch.setenv("DRAKE_ALLOW_NETWORK", "none")
    with pytest.raises(RuntimeError, match="DRAKE_ALLOW_NETWORK"):
        Meshcat(port=0)
    monkeypatch.setenv("DRAKE_ALLOW_NETWORK", "lcm:meshcat")
    Meshcat(port=0)


def test_foreign_pages_are_refused(meshcat):
    url = f"http://localhost:{meshcat.port()}/"
    assert b"<title>sheldrake</title>" in urllib.request.urlopen(url).read()
    for headers in ({"Host": "evil.example"}, {"Origin": "http://evil.example"}, {"Origin": "null"}):
        with pytest.raises(urllib.error.HTTPError) as refusal:
            urllib.request.urlopen(urllib.request.Request(url, headers=headers))
        assert refusal.value.code == 403
    for origin in ("http://evil.example", "null", f"http://localhost:{meshcat.port() + 1}"):
        with pytest.raises(InvalidStatus):
            join(meshcat, origin=origin)
    with join(meshcat, origin=f"http://localhost:{meshcat.port()}") as client:
        assert client.recv(timeout=240)


@pytest.mark.parametrize("bad", [b"\xc1 no msgpack", b"", "text", b"x" * (9 * 2**20)])
def test_bad_message_closes_that_page_only(meshcat, bad):
    with join(meshcat) as good, join(meshcat) as evil:
        good.recv(timeout=240)
        evil.send(bad)
        with pytest.raises(ConnectionClosed):
            while True:
                evil.recv(timeout=240)
        wait_until(lambda: meshcat.GetNumActiveConnections() == 1)
        meshcat.SetObject("box", Box(1, 1, 1))
        assert receive_names(good, "/drake/box")


def messages_of(frame):
    """Returns the messages of one of viser's binary frames, arrays left out."""
    import zstandard

    size = int.from_bytes(frame[8:16], "little")
    return msgspec.msgpack.decode(zstandard.ZstdDecompressor().decompress(frame[16 : 16 + size]))["messages"]


def receive_until(client, predicate, seconds=240.0):
    """Receives messages until one fulfils the predicate, and returns all."""
    deadline, seen = time.monotonic() + seconds, []
    while time.monotonic() < deadline:
        try:
            batch = messages_of(client.recv(timeout=0.2))
        except TimeoutError:
            continue
        seen += batch
        if any(predicate(message) for message in batch):
            return seen
    raise AssertionError(f"never received; got {[m['type'] for m in seen]}")


def receive_names(client, name):
    return receive_until(client, lambda m: str(m.get("name", "")).startswith(name))


@pytest.mark.parametrize(
    ("lines", "status"),
    [
        (["Host: localhost:{port}", "Host: localhost"], 400),
        ([], 400),
        (["Host: localhost:{port}", "Origin: http://localhost:{port}", "Origin: http://evil.example"], 400),
        (["Host: localhost:{port}", "Upgrade: websocket", "Upgrade: x"], 400),
        (["Host: [::1"], 403),
        (["Host: localhost:{port}", "Origin: http://["], 403),
        (["Host: localhost:{port}", "Accept-Encoding: gzip", "Accept-Encoding: x"], 200),
    ],
)
def test_requests_that_no_browser_sends(meshcat, lines, status):
    request = "\r\n".join(["GET / HTTP/1.1", *lines, "", ""]).format(port=meshcat.port())
    with socket.create_connection(("127.0.0.1", meshcat.port()), timeout=60) as client:
        client.sendall(request.encode())
        assert client.recv(100).startswith(f"HTTP/1.1 {status} ".encode())


def test_late_page_gets_the_whole_scene(meshcat):
    meshcat.SetObject("box", Box(1, 2, 3), Rgba(0.2, 0.4, 0.6, 0.5))
    meshcat.SetTransform("box", Pose([1, 2, 3]))
    meshcat.SetObject("gone", Sphere(1))
    meshcat.Delete("gone")
    with join(meshcat) as client:
        seen = receive_until(client, lambda m: m["type"] == "ReplayDoneMessage")
    made = {m["name"]: m for m in seen if m["type"] == "BoxMessage"}
    assert made["/drake/box/<object>"]["props"]["dimensions"] == [1, 2, 3]
    assert made["/drake/box/<object>"]["props"]["color"] == [51, 102, 153]
    assert made["/drake/box/<object>"]["props"]["opacity"] == 0.5
    assert {"name": "/drake/box", "position": [1, 2, 3], "owner": "", "type": "SetPositionMessage"} in seen
    assert not any("gone" in str(m.get("name")) and m["type"] == "IcosphereMessage" for m in seen)


def test_unchanged_poses_are_not_sent(meshcat):
    meshcat.SetObject("box", Box(1, 1, 1))
    with join(meshcat) as client:
        receive_until(client, lambda m: m["type"] == "ReplayDoneMessage")
        meshcat.SetTransform("box", Pose([0, 0, 1]))
        receive_until(client, lambda m: m["type"] == "SetPositionMessage" and m["position"] == [0, 0, 1])
        for _ in range(20):
            meshcat.SetTransform("box", Pose([0, 0, 1]))
        meshcat.SetTransform("box", Pose([0, 0, 2]))
        seen = receive_until(client, lambda m: m["type"] == "SetPositionMessage" and m["position"] == [0, 0, 2])
        assert sum(m["type"] == "SetPositionMessage" for m in seen) == 1


def test_publishing_is_bundled(meshcat):
    """A thousand poses set at once reach the page as a handful of messages, the last one right."""
    meshcat.SetObject("box", Box(1, 1, 1))
    with join(meshcat) as client:
        receive_until(client, lambda m: m["type"] == "ReplayDoneMessage")
        for i in range(1000):
            meshcat.SetTransform("box", Pose([0, 0, i]))
        seen = receive_until(client, lambda m: m["type"] == "SetPositionMessage" and m["position"] == [0, 0, 999])
        assert sum(m["type"] == "SetPositionMessage" for m in seen) < 100


def test_paths():
    meshcat = Meshcat(port=0)
    assert not meshcat.HasPath("/drake") and not meshcat.HasPath("a")
    meshcat.SetTransform("a/b", Pose([0, 0, 0]))
    for path in ("a", "a/b", "/drake", "/drake/a/b/", "/drake//a"):
        assert meshcat.HasPath(path), path
    assert not meshcat.HasPath("/a") and not meshcat.HasPath("a/b/c")
    meshcat.Delete("/")  # silently does nothing
    assert meshcat.HasPath("a")
    meshcat.SetProperty("/other", "visible", False)
    meshcat.Delete()
    assert not meshcat.HasPath("/drake") and meshcat.HasPath("/other")


def test_delete_object_keeps_the_children(meshcat):
    meshcat.SetObject("a", Box(1, 1, 1))
    meshcat.SetObject("a/b", Box(1, 1, 1))
    meshcat.Delete("a/<object>")
    assert meshcat.HasPath("a") and meshcat.HasPath("a/b")
    with join(meshcat) as client:
        seen = receive_until(client, lambda m: m["type"] == "ReplayDoneMessage")
    assert [m["name"] for m in seen if m["type"] == "BoxMessage"] == ["/drake/a/b/<object>"]


def test_set_transform_takes_rigid_and_stretching_matrices(meshcat):
    meshcat.SetObject("a", Box(1, 1, 1))
    meshcat.SetTransform("a", matrix=np.diag([2.0, 3.0, 4.0, 1.0]))
    with join(meshcat) as client:
        seen = receive_until(client, lambda m: m["type"] == "ReplayDoneMessage")
    box = [m for m in seen if m.get("name") == "/drake/a/<object>"]
    scale = [m["updates"]["scale"] for m in box if "scale" in m.get("updates", {})] or [box[0]["props"]["scale"]]
    assert scale[-1] == [2.0, 3.0, 4.0], "stretched along its axes"
    shear = np.eye(4)
    shear[0, 1] = 0.5
    meshcat.SetTransform("a", matrix=shear)
    with join(meshcat) as client:
        seen = receive_until(client, lambda m: m["type"] == "ReplayDoneMessage")
    types = [m["type"] for m in seen if m.get("name") == "/drake/a/<object>" and "props" in m]
    assert types == ["MeshMessage"], "drawn as triangles, with the shear built in"
    with pytest.raises(TypeError, match=r"shape \(4, 4\), got an array of shape \(3, 3\)"):
        meshcat.SetTransform("a", np.eye(3))
    with pytest.raises(TypeError, match="got str"):
        meshcat.SetTransform("a", "b")


def test_half_space_is_a_finite_plate(meshcat):
    meshcat.SetObject("ground", HalfSpace(), Rgba(1, 0, 0))
    with join(meshcat) as client:
        seen = receive_until(client, lambda m: m["type"] == "ReplayDoneMessage")
    plate = next(m for m in seen if m.get("name") == "/drake/ground/<object>" and m["type"] == "GridMessage")
    assert plate["props"]["plane_color"] == [255, 0, 0] and 1 < plate["props"]["width"] < 100
    assert not plate["props"]["infinite_grid"]


def test_a_mesh_without_a_file_is_told_and_not_drawn(meshcat, caplog):
    meshcat.SetObject("x", Mesh("/nowhere/none.obj"))
    assert "/nowhere/none.obj" in caplog.text and not meshcat.HasPath("x")


def test_wrong_arguments_change_nothing(meshcat):
    cases = [
        (TypeError, lambda: meshcat.SetObject("x", 3)),
        (TypeError, lambda: meshcat.SetObject("x", Box(1, 1, 1), [1, 0, 0, 1])),
        (TypeError, lambda: meshcat.SetLine("x", np.zeros((2, 3)))),
        (TypeError, lambda: meshcat.SetCameraTarget([1, 2])),
        (ValueError, lambda: meshcat.SetLineSegments("x", np.zeros((3, 2)), np.zeros((3, 3)))),
        (ValueError, lambda: meshcat.SetTriangleMesh("x", np.zeros((3, 3)), [[0], [1], [3]])),
        (ValueError, lambda: meshcat.PlotSurface("x", np.eye(2), np.eye(2), np.eye(3))),
        (TypeError, lambda: meshcat.SetProperty("x", "visible", "yes")),
        (RuntimeError, lambda: meshcat.SetEnvironmentMap("/nowhere/none.png")),
    ]
    for error, call in cases:
        with pytest.raises(error, match=r"^Meshcat\."):
            call()
        assert not meshcat.HasPath("x")


def test_buttons(meshcat):
    meshcat.AddButton("go", "KeyG")
    assert meshcat.GetButtonNames() == ["go"] and meshcat.GetButtonClicks("go") == 0
    click = msgspec.msgpack.encode({"type": "button", "name": "go"})
    meshcat._InjectWebsocketMessage(message=click)
    meshcat._InjectWebsocketMessage(message=msgspec.msgpack.encode({"type": "key", "code": "KeyG"}))
    assert meshcat.GetButtonClicks("go") == 2
    with pytest.raises(RuntimeError, match=r"keycode 'KeyG', which is not 'KeyH'"):
        meshcat.AddButton("go", "KeyH")
    meshcat.AddButton("go", "KeyG")
    assert meshcat.GetButtonClicks("go") == 0
    with pytest.raises(RuntimeError, match=r"any button named stop. The registered button names are \(go\)"):
        meshcat.GetButtonClicks("stop")
    assert not meshcat.DeleteButton("stop", strict=False) and meshcat.DeleteButton("go")
    with pytest.raises(RuntimeError, match="any button named go"):
        meshcat.DeleteButton("go")


def test_sliders_round_as_drake_does(meshcat):
    """Numbers from pydrake 1.51.1."""
    assert meshcat.AddSlider("s", 0, 1, 0.3, 0.44, "KeyA", "KeyB") == pytest.approx(0.3)
    assert meshcat.AddSlider("t", 0.05, 1, 0.3, 2) == pytest.approx(0.9)
    assert meshcat.SetSliderValue("s", 0.7) == pytest.approx(0.6) == meshcat.GetSliderValue("s")
    meshcat._InjectWebsocketMessage(message=msgspec.msgpack.encode({"type": "key", "code": "KeyB"}))
    assert meshcat.GetSliderValue("s") == pytest.approx(0.9)
    assert meshcat.GetSliderNames() == ["s", "t"]
    with pytest.raises(RuntimeError, match="already has a slider named s"):
        meshcat.AddSlider("s", 0, 1, 0.1, 0)
    with pytest.raises(RuntimeError, match="slider named 's'"):
        meshcat.AddButton("s")
    with pytest.raises(RuntimeError, match="step of 'u' must be positive"):
        meshcat.AddSlider("u", 0, 1, 0, 0)
    meshcat.DeleteAddedControls()
    assert meshcat.GetSliderNames() == []


def test_gamepad(meshcat):
    assert str(meshcat.GetGamepad()) == str(Meshcat.Gamepad()) and meshcat.GetGamepad().index is None
    pad = {"index": 1, "button_values": [0, 0.5], "axes": [0.1, 0.2]}
    meshcat._InjectWebsocketMessage(message=msgspec.msgpack.encode({"type": "gamepad", "name": "", "gamepad": pad}))
    meshcat.GetGamepad().axes.append(1.0)  # a copy
    assert str(meshcat.GetGamepad()) == "Gamepad(index=1, button_values=[0.0, 0.5], axes=[0.1, 0.2])"


@pytest.mark.parametrize("bad", [b"abc", msgspec.msgpack.encode({"type": "?"}), msgspec.msgpack.encode([1])])
def test_unreadable_injected_messages_are_survived(meshcat, bad):
    meshcat._InjectWebsocketMessage(message=bad)
    assert meshcat.GetGamepad().index is None


def test_recording(meshcat):
    meshcat.SetObject("box", Box(1, 1, 1))
    meshcat.SetTransform("box", Pose([0, 0, 9]), 0.25)
    assert meshcat.get_mutable_recording()._num_frames() == 0, "not recording yet"
    meshcat.StartRecording(frames_per_second=32.0, set_visualizations_while_recording=False)
    for i in range(33):
        meshcat.SetTransform("box", Pose([0, 0, i / 32]), i / 32)
    meshcat.StopRecording()
    recording = meshcat.get_mutable_recording()
    assert recording._num_frames() == 33 and recording.frames_per_second() == 32.0
    assert meshcat._hub.tree.get("/drake/box").pose[2, 3] == 9, "the page was left alone"
    meshcat.DeleteRecording()
    assert meshcat.get_mutable_recording()._num_frames() == 0


def test_static_html_is_self_contained_and_small(meshcat):
    meshcat.SetObject("box", Box(1, 1, 1))
    meshcat.StartRecording()
    for i in range(128):
        meshcat.SetTransform("box", Pose([0, 0, i / 64]), i / 64)
    meshcat.PublishRecording()
    html = meshcat.StaticHtml()
    assert html.startswith("<!doctype html>") and "<title>sheldrake</title>" in html
    assert len(html) < 1.2e6
    head = html[: html.index("__VISER_EMBED_DATA__")]
    assert 'src="http' not in head and 'href="http' not in head
    assert meshcat.StaticZip()[:2] == b"PK"


@pytest.mark.parametrize("path", ["/Grid", "/Axes"])
def test_an_object_in_the_place_of_the_grid(meshcat, path):
    meshcat.SetObject(path, Sphere(0.5))
    meshcat.SetProperty(path, "visible", False)
    assert meshcat.StaticHtml().count("</html>") == 1
    meshcat.SetObject("/far", Box(50, 50, 50))
    meshcat.Set2dRenderMode()
    meshcat.ResetRenderMode()
    meshcat.Delete(path)
    meshcat.SetProperty(path, "visible", True)
    assert meshcat.StaticHtml().count("</html>") == 1


def test_downloads(meshcat):
    meshcat.SetObject("box", Box(1, 1, 1))
    page = urllib.request.urlopen(f"http://localhost:{meshcat.port()}/download").read()
    assert b"__VISER_EMBED_DATA__" in page
    assert urllib.request.urlopen(f"http://localhost:{meshcat.port()}/download.zip").read()[:2] == b"PK"


def test_realtime_rate():
    from sheldrake.geometry._meshcat.realtime import RealtimeRateCalculator

    now = [100.0]
    calculator = RealtimeRateCalculator(0.25, clock=lambda: now[0])
    assert calculator.update(0.0) is None
    now[0] += 0.2
    assert calculator.update(0.1) is None
    now[0] += 0.2
    assert calculator.update(0.2) == pytest.approx(0.5)
    assert calculator.update(0.2) is None
    assert calculator.update(0.0) == 0.0, "going back starts anew"
    with pytest.raises(RuntimeError, match="realtime_rate_period must be positive"):
        Meshcat(MeshcatParams(port=0, realtime_rate_period=0))


def test_set_realtime_rate(meshcat):
    assert meshcat.GetRealtimeRate() == 0.0
    meshcat.SetRealtimeRate(0.5)
    assert meshcat.GetRealtimeRate() == 0.5


def test_initial_properties():
    item = MeshcatParams.PropertyTuple(path="a", property="visible", value=False)
    meshcat = Meshcat(MeshcatParams(port=0, initial_properties=[item]))
    assert meshcat.HasPath("a")


def test_deleted_meshcat_leaves_no_thread():
    before = set(threading.enumerate())
    meshcat = Meshcat(port=0)
    meshcat.SetObject("box", Box(1, 1, 1))
    meshcat.AddButton("go")
    meshcat.StaticHtml()
    port, alive = meshcat.port(), weakref.ref(meshcat)
    del meshcat
    assert alive() is None, "a reference cycle holds the Meshcat"
    wait_until(lambda: set(threading.enumerate()) <= before)
    gc.collect()
    with pytest.raises(OSError):
        socket.create_connection(("127.0.0.1", port), timeout=1).close()


def test_process_ends_by_itself_and_says_the_address_only():
    code = "from sheldrake.geometry import Meshcat, Box; m = Meshcat(0); m.SetObject('a', Box(1, 1, 1))"
    code += "; print(m.port())"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, timeout=240)
    assert done.returncode == 0
    assert done.stderr.strip() == f"Meshcat listening for connections at http://localhost:{int(done.stdout)}"


def test_importing_geometry_does_not_import_viser():
    code = "import sheldrake.geometry, sys; print([m for m in ('viser', 'trimesh', 'llvmlite') if m in sys.modules])"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, timeout=240)
    assert done.stdout.strip() == "[]", done.stdout + done.stderr


def test_animation_frames_and_types():
    animation = MeshcatAnimation(frames_per_second=64.0)
    assert animation.frame(0.5) == 32
    animation.set_start_time(1.0)
    assert animation.frame(1.51) == 32
    with pytest.raises(ValueError, match="before start_time"):
        animation.frame(0.5)
    animation.SetProperty(1, "a", "visible", True)
    with pytest.raises(RuntimeError, match="type boolean, got number"):
        animation.SetProperty(2, "a", "visible", 1.0)
    animation.SetProperty(1, "q", "position", [1.0, 2.0, 3.0])
    with pytest.raises(RuntimeError, match="'position' of '/drake/q'"):
        animation.SetTransform(1, "q", RigidTransform())
    with pytest.raises(ValueError, match="integer >= 0"):
        animation.SetTransform(-1, "a", RigidTransform())
    with pytest.raises(ValueError, match="positive integer"):
        animation.set_repetitions(0)
    assert (animation.loop_mode(), animation.repetitions()) == (MeshcatAnimation.LoopMode.kLoopRepeat, 1)
    assert animation.autoplay() and animation.clamp_when_finished()


def test_simulation_pays_little_for_publishing(meshcat):
    """60 bodies at 64 Hz take less than 5 % of a core from the caller: 0.78 ms a publish; without pages far less."""
    paths = [f"/drake/v/b{i}" for i in range(60)]
    poses = np.tile(np.eye(4)[:3], (60, 1, 1))
    costs = []
    for i in range(200):
        poses = poses.copy()
        poses[:, 2, 3] = i
        start = time.thread_time()
        meshcat._set_poses(paths, poses)
        costs.append(time.thread_time() - start)
    assert min(costs) < 0.78e-3


def test_a_player_shows_nothing_after_its_meshcat_has_stopped(meshcat):
    """Else a page that closes at exit makes the program say so."""
    animation = MeshcatAnimation(64)
    animation.set_repetitions(1000)
    for frame in range(64):
        animation.SetTransform(frame, "a", RigidTransform([0, 0, frame]))
    meshcat.SetObject("a", Sphere(1))
    with join(meshcat):
        meshcat.SetAnimation(animation)
        hub = meshcat._hub
        player = hub.player
        wait_until(lambda: player._timer is not None)
        hub.stop()
        shown = []
        player.show = shown.append
        assert player._timer is None
        player._tick(0.0)
    assert shown == []


def test_fields_of_params_are_found_on_the_class():
    assert (
        MeshcatParams.initial_properties == []
        and MeshcatParams().initial_properties is not MeshcatParams.initial_properties
    )


def test_the_camera_is_placed_for_what_is_seen(meshcat):
    """Neither for what is hidden, nor for notes about the scene; of the ground the height counts alone."""
    page = meshcat._hub.page
    assert page.outline() is None
    meshcat.SetObject("robot/arm", Box(0.2, 0.4, 0.6))
    meshcat.SetTransform("robot", RigidTransform([1.0, 0.0, 0.5]))
    meshcat.SetObject("ground", HalfSpace())
    for far in ("forces/arrow", "proximity/robot/arm"):
        meshcat.SetObject(far, Sphere(1e3))
    meshcat._note("forces")
    meshcat.SetProperty("proximity", "visible", False)
    points = page.outline()
    assert points.min(axis=0) == pytest.approx([0.9, -0.2, 0.0]) and points.max(axis=0) == pytest.approx(
        [1.1, 0.2, 0.8]
    )
    assert page.lowest("/drake/robot") == pytest.approx(0.2) and page.lowest("/drake/forces") is None


@pytest.mark.parametrize("sizes", [(1, 1, 1), (0.01, 0.01, 2), (3, 3, 0.01), (0, 0, 0)])
def test_what_the_camera_is_placed_for_fills_three_quarters_of_a_square(sizes):
    rng = np.random.default_rng(1)
    points = rng.uniform(-0.5, 0.5, (50, 3)) * sizes + [3.0, 4.0, 5.0]
    target, position, _ = viewpoint(points)
    forward = (target - position) / np.linalg.norm(target - position)
    right = np.cross(forward, [0, 0, 1]) / np.linalg.norm(np.cross(forward, [0, 0, 1]))
    depth = (points - position) @ forward
    assert (depth > 0).all()
    seen = np.array([(points - position) @ u / depth for u in (right, np.cross(right, forward))]) / np.tan(
        np.radians(20)
    )
    sides = [(u.min(), u.max()) for u in seen]
    if any(sizes):
        widest = max(sides, key=lambda side: side[1] - side[0])
        assert widest == pytest.approx((-0.75, 0.75), abs=1e-9)
    assert np.abs(seen).max() < 0.75 + 1e-9


def test_a_notebook_keeps_the_replay_of_a_recording():
    meshcat = Meshcat()
    meshcat.SetObject("box", Box(0.1, 0.2, 0.3))
    assert f'src="{meshcat.web_url()}"' in meshcat._repr_html_()
    meshcat.StartRecording()
    meshcat.SetTransform("box", Pose([0.0, 0.0, 1.0]), 0.5)
    assert "srcdoc" not in meshcat._repr_html_(), "not before it is published"
    meshcat.PublishRecording()
    (page,) = re.findall('srcdoc="([^"]*)"', meshcat._repr_html_())
    assert html.unescape(page) == meshcat.StaticHtml()
    meshcat.DeleteRecording()
    meshcat.PublishRecording()
    assert "srcdoc" not in meshcat._repr_html_()
