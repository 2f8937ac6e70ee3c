"""The viewer of 2021: publishes to a running meshcat-server, else to our page; never waits long."""

import socket
import threading
import time

import pytest

from sheldrake._pydrake.retired.meshcat_visualizer import ConnectMeshcatVisualizer
from sheldrake.common.deprecation import DrakeDeprecationWarning
from sheldrake.geometry import Box, GeometryInstance, HalfSpace, MakePhongIllustrationProperties, SceneGraph
from sheldrake.math import RigidTransform
from sheldrake.systems.analysis import Simulator
from sheldrake.systems.framework import DiagramBuilder

PATIENCE = 60.0
"""A hang lasts longer than this [s], a busy machine does not."""


def free_port():
    with socket.socket() as s:
        s.bind(("127.0.0.1", 0))
        return s.getsockname()[1]


def connect(**options):
    builder = DiagramBuilder()
    scene_graph = builder.AddSystem(SceneGraph())
    source = scene_graph.RegisterSource("models")
    for shape in (Box(1, 2, 3), HalfSpace()):
        name = type(shape).__name__
        geometry = scene_graph.RegisterAnchoredGeometry(source, GeometryInstance(RigidTransform(), shape, name))
        scene_graph.AssignRole(source, geometry, MakePhongIllustrationProperties([1, 0, 0, 1]))
    with pytest.warns(DrakeDeprecationWarning, match="use MeshcatVisualizer.AddToBuilder"):
        visualizer = ConnectMeshcatVisualizer(
            builder=builder, scene_graph=scene_graph, output_port=scene_graph.get_query_output_port(), **options
        )
    return visualizer, builder.Build()


def test_without_a_server_our_page_is_used_and_said(capsys):
    url = f"tcp://127.0.0.1:{free_port()}"
    start = time.monotonic()
    visualizer, diagram = connect(zmq_url=url)
    assert time.monotonic() - start < PATIENCE
    ours = visualizer.meshcat.web_url()
    expected = f"No meshcat-server answers at {url}: the scene is shown at {ours} instead."
    assert capsys.readouterr().out.splitlines() == [expected]
    visualizer.load()
    assert visualizer.meshcat.HasPath("/drake/drake")
    simulator = Simulator(diagram)
    simulator.Initialize()
    simulator.AdvanceTo(0.1)
    assert visualizer.vis is visualizer.meshcat


def test_a_silent_port_does_not_hang():
    """Something listens, accepts, and never says a word."""
    with socket.create_server(("127.0.0.1", 0)) as silent:
        start = time.monotonic()
        visualizer, _ = connect(zmq_url=f"tcp://127.0.0.1:{silent.getsockname()[1]}")
        assert time.monotonic() - start < PATIENCE
    assert visualizer.meshcat is not None


@pytest.mark.parametrize("bad", ["not a url", "tcp://nowhere.invalid:6000"])
def test_bad_addresses_do_not_fail(bad):
    visualizer, _ = connect(zmq_url=bad)
    assert visualizer.meshcat is not None


class FakeServer:
    """Answers as meshcat-server does, and keeps what it is told."""

    def __init__(self, answers=10**6):
        zmq = pytest.importorskip("zmq")
        pytest.importorskip("meshcat")
        self._context = zmq.Context()
        self._socket = self._context.socket(zmq.REP)
        self.port = self._socket.bind_to_random_port("tcp://127.0.0.1")
        self.told, self._left, self._stop = [], answers, False
        self._thread = threading.Thread(target=self._run)
        self._thread.start()

    def _run(self):
        while not self._stop:
            if self._left > 0 and self._socket.poll(50):
                parts = self._socket.recv_multipart()
                self._left -= 1
                self.told.append([part.decode(errors="replace") for part in parts[:2]])
                self._socket.send(b"http://server/static/" if parts == [b"url"] else b"ok")
            elif self._left <= 0:
                time.sleep(0.05)

    def close(self):
        self._stop = True
        self._thread.join()
        self._socket.close(0)
        self._context.term()


@pytest.fixture
def server():
    server = FakeServer()
    yield server
    server.close()


def test_a_running_server_gets_the_scene(server, capsys):
    visualizer, diagram = connect(zmq_url=f"tcp://127.0.0.1:{server.port}")
    assert visualizer.meshcat is None
    assert "http://server/static/" in capsys.readouterr().out
    visualizer.load()
    simulator = Simulator(diagram)
    simulator.Initialize()
    simulator.AdvanceTo(0.1)
    kinds = [kind for kind, *_ in server.told]
    assert kinds[0] == "url" and "delete" in kinds
    drawn = [path for kind, *rest in server.told if kind == "set_object" for path in rest]
    assert len(set(drawn)) == 2 and all(path.startswith("/drake/drake/") for path in drawn)


def test_a_server_that_dies_does_not_stop_the_simulation():
    server = FakeServer(answers=3)
    try:
        _, diagram = connect(zmq_url=f"tcp://127.0.0.1:{server.port}")
        simulator = Simulator(diagram)
        start = time.monotonic()
        simulator.Initialize()
        simulator.AdvanceTo(2.0)
        assert time.monotonic() - start < PATIENCE
    finally:
        server.close()
