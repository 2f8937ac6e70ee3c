"""A render server in this process, which draws what it is sent with our own renderer."""

import hashlib
import http.server
import io
import json
import threading

import numpy as np
import pytest
from render_scenes import DOWN, Studio, looking_from, seen

from sheldrake import geometry as g
from sheldrake.common import MemoryFile
from sheldrake.math import RigidTransform, RotationMatrix
from sheldrake.systems.sensors import CameraInfo

pytest.importorskip("trimesh")
PIL_Image = pytest.importorskip("PIL.Image")
UNTURNED = RigidTransform(RotationMatrix.MakeXRotation(-np.pi / 2))  # mesh files are turned from y up to z up; not this
X_WC = looking_from([1.2, 0.9, 1.1])


class Server(http.server.BaseHTTPRequestHandler):
    """Answers each form with a picture by the rasterizer."""

    requests, reply = [], None

    def do_POST(self):
        body = self.rfile.read(int(self.headers["Content-Length"]))
        boundary = self.headers["Content-Type"].split("boundary=")[1].encode()
        form = {}
        for part in body.split(b"--" + boundary)[1:-1]:
            head, value = part[2:-2].split(b"\r\n\r\n", 1)
            form[head.split(b'name="')[1].split(b'"')[0].decode()] = value
        Server.requests.append((self.path, form))
        status, data = Server.reply or (200, drawn(form))
        self.send_response(status)
        self.send_header("Content-Length", str(len(data)))
        self.end_headers()
        self.wfile.write(data)

    def log_message(self, *args):
        pass


def drawn(form):
    """The picture that a form asks for."""
    kind, scene = form["image_type"].decode(), form["scene"]
    number = {name: float(form[name]) for name in ("near", "far", "focal_x", "focal_y", "center_x", "center_y")}
    lens = CameraInfo(
        int(form["width"]), int(form["height"]), *(number[n] for n in ("focal_x", "focal_y", "center_x", "center_y"))
    )
    nodes = json.loads(scene)["nodes"]
    (matrix,) = [node["matrix"] for node in nodes if "camera" in node]
    M = np.array(matrix).reshape(4, 4).T
    X = RigidTransform(RotationMatrix(M[:3, :3] @ np.diag([1.0, -1.0, -1.0])), M[:3, 3])
    mesh = g.Mesh(g.InMemoryMesh(MemoryFile(scene, ".gltf", "scene.gltf")))
    clear = {"color": [204 / 255, 229 / 255, 1.0], "label": [254 / 255, 127 / 255, 0.0]}  # kEmpty is 32766
    lamps = [g.LightParameter(frame="world", direction=[0, 0, -1.0])] if kind == "label" else []
    studio = Studio(seen(mesh, UNTURNED, color=None), default_clear_color=clear.get(kind, [0, 0, 0]), lights=lamps)
    limits = {"lens": lens, "near": number["near"], "far": number["far"]}
    if kind == "depth":
        least, most = float(form["min_depth"]), float(form["max_depth"])
        picture, format_ = PIL_Image.fromarray(studio.depths(X, least, most, **limits)), "TIFF"
    else:
        picture, format_ = PIL_Image.fromarray(studio.colors(X, **limits)[..., :3].copy()), "PNG"
    stream = io.BytesIO()
    picture.save(stream, format=format_)
    return stream.getvalue()


@pytest.fixture
def url():
    server = http.server.ThreadingHTTPServer(("127.0.0.1", 0), Server)
    Server.requests, Server.reply = [], None
    thread = threading.Thread(target=server.serve_forever, daemon=True)
    thread.start()
    yield f"http://127.0.0.1:{server.server_address[1]}"
    server.shutdown()
    thread.join()
    server.server_close()


def client(url, *things, **params):
    return Studio(*things, engine=g.MakeRenderEngineGltfClient(g.RenderEngineGltfClientParams(base_url=url, **params)))


def things():
    return [
        seen(g.Box(0.5, 0.4, 0.3), RigidTransform([0.1, 0.2, 0.15]), color=(0.2, 0.6, 0.9, 1.0), label=607),
        seen(g.HalfSpace(), color=(0.5, 0.5, 0.4, 1.0), label=3),
        seen(g.Sphere(0.2), RigidTransform([-0.4, 0.1, 0.3]), color=(0.9, 0.3, 0.2, 1.0), label=4),
    ]


def test_what_the_server_draws_is_what_is_drawn_here(url):
    there, here = client(url, *things()), Studio(*things())
    assert there.scene_graph.GetRendererTypeName("r").endswith("render_gltf_client::internal::RenderEngineGltfClient")
    colors, expected = there.colors(X_WC).astype(int), here.colors(X_WC).astype(int)
    assert (np.abs(colors - expected).max(axis=-1) > 8).mean() < 0.02  # the sphere is sent as triangles
    depths, expected = there.depths(X_WC), here.depths(X_WC)
    both = np.isfinite(depths) & np.isfinite(expected)
    assert (np.isfinite(depths) != np.isfinite(expected)).mean() < 0.01
    assert (np.abs(depths - expected)[both] > 0.01).mean() < 0.02 and np.median(np.abs(depths - expected)[both]) < 1e-6


def test_labels_are_colours_of_the_scene(url):
    X = RigidTransform(DOWN, [0, 0, 2])  # from above every surface has all the light of the server's lamp
    flat = [seen(g.Box(0.5, 0.4, 0.3), label=607), seen(g.Box(2, 2, 0.1), label=3)]
    labels = client(url, *flat).labels(X)
    assert np.array_equal(labels, Studio(*flat).labels(X)) and set(np.unique(labels)) == {3, 607, 32766}
    hidden = [seen(g.Box(0.5, 0.4, 0.3), label=g.RenderLabel.kDoNotRender), seen(g.Box(2, 2, 0.1), label=3)]
    assert set(np.unique(client(url, *hidden).labels(X))) == {3, 32766}


def test_textures_and_opacity_go_along(url, tmp_path):
    ramp = np.zeros((32, 32, 3), np.uint8)
    ramp[..., 0], ramp[..., 1] = 8 * np.arange(32), 8 * np.arange(32)[:, None]
    PIL_Image.fromarray(ramp).save(tmp_path / "ramp.png")
    picture = [seen(g.Box(1, 1, 1), color=None, texture=tmp_path / "ramp.png")]
    X = RigidTransform(DOWN, [0, 0, 2])
    there, here = client(url, *picture).colors(X).astype(int), Studio(*picture).colors(X).astype(int)
    assert np.abs(there - here)[4:40, 15:45].max() <= 1 and here[22, 35, 0] - here[22, 25, 0] > 20
    client(url, seen(g.Sphere(1.0), color=(1, 0, 0, 0.5))).colors(X)
    (material,) = json.loads(Server.requests[-1][1]["scene"])["materials"]
    assert material["alphaMode"] == "BLEND" and material["pbrMetallicRoughness"]["baseColorFactor"] == [1, 0, 0, 0.5]


def test_the_form_says_everything(url):
    client(url + "/", *things(), render_endpoint="/draw").depths(X_WC, least=0.2, most=7.0, near=0.1, far=8.0)
    ((path, form),) = Server.requests
    assert path == "/draw" and form["submit"] == b"Render" and form["image_type"] == b"depth"
    assert form["scene_sha256"].decode() == hashlib.sha256(form["scene"]).hexdigest()
    numbers = {name: float(form[name]) for name in ("near", "far", "min_depth", "max_depth", "width", "height")}
    assert numbers == {"near": 0.1, "far": 8.0, "min_depth": 0.2, "max_depth": 7.0, "width": 64, "height": 48}
    lens = {name: float(form[name]) for name in ("focal_x", "focal_y", "center_x", "center_y")}
    assert lens == {"focal_x": 50.0, "focal_y": 60.0, "center_x": 30.5, "center_y": 22.5}
    assert set(form) >= {"fov_x", "fov_y"}


def answered(image, format_="PNG"):
    stream = io.BytesIO()
    PIL_Image.fromarray(image).save(stream, format=format_)
    return 200, stream.getvalue()


def test_other_answers_that_a_server_may_give(url):
    studio = client(url)
    Server.reply = answered(np.full((48, 64), 1250, np.uint16))
    assert (studio.depths(X_WC) == np.float32(1.25)).all()
    Server.reply = answered(np.full((48, 64), 65535, np.uint16))
    assert np.isinf(studio.depths(X_WC)).all()
    Server.reply = answered(np.full((48, 64), 77, np.uint16))
    assert (studio.labels(X_WC) == 77).all()
    Server.reply = answered(np.full((48, 64, 4), 9, np.uint8))
    assert (studio.colors(X_WC) == 9).all()


def test_answers_that_make_no_sense(url):
    studio = client(url)
    for reply, kind, match in (
        ((500, b"out of memory"), "colors", "HTTP status 500: out of memory"),
        ((200, b"hello"), "colors", "no PNG or TIFF"),
        (answered(np.zeros((4, 5, 3), np.uint8)), "colors", "5 x 4 pixels, not 64 x 48"),
        (answered(np.zeros((48, 64), np.uint8)), "colors", "grey image for a color"),
        (answered(np.zeros((48, 64, 3), np.uint8)), "depths", "colored image for a depth"),
    ):
        Server.reply = reply
        with pytest.raises(RuntimeError, match=match):
            getattr(studio, kind)(X_WC)


def test_no_server_and_no_network(monkeypatch):
    with pytest.raises(RuntimeError, match=r"no answer from http://127\.0\.0\.1:9/render"):
        client("http://127.0.0.1:9").colors(X_WC)
    monkeypatch.setenv("DRAKE_ALLOW_NETWORK", "none")
    with pytest.raises(RuntimeError, match="DRAKE_ALLOW_NETWORK"):
        g.MakeRenderEngineGltfClient()
    monkeypatch.setenv("DRAKE_ALLOW_NETWORK", "lcm:render_gltf_client")
    assert "base_url: http://127.0.0.1:8000" in g.MakeRenderEngineGltfClient().GetParameterYaml()


def test_what_was_exchanged_is_kept_on_request(url, tmp_path, monkeypatch):
    monkeypatch.setattr("tempfile.tempdir", str(tmp_path))
    client(url, *things(), cleanup=False).colors(X_WC)
    kept = sorted(path.name for path in tmp_path.rglob("color*"))
    assert kept == ["color.gltf", "color.image"]
