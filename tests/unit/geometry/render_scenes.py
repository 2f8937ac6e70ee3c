"""Scenes for pictures, and where the rays of a camera meet simple shapes."""

import numpy as np

from sheldrake import geometry as g
from sheldrake.math import RigidTransform, RotationMatrix
from sheldrake.systems.sensors import CameraInfo

DOWN = RotationMatrix.MakeXRotation(np.pi)  # a camera with this orientation looks down
LENS = CameraInfo(64, 48, 50.0, 60.0, 30.5, 22.5)  # pixel (30, 22) looks straight ahead


def looking_from(p_WC, target=(0.0, 0.0, 0.0)):
    """Pose of a camera at p_WC that looks at a point, its picture upright."""
    z = np.subtract(target, p_WC) / np.linalg.norm(np.subtract(target, p_WC))
    x = np.cross(z, [0.0, 0.0, 1.0])
    x /= np.linalg.norm(x)
    return RigidTransform(RotationMatrix(np.column_stack([x, np.cross(z, x), z])), p_WC)


def core(lens=LENS, near=0.05, far=100.0, renderer="r"):
    return g.RenderCameraCore(renderer, lens, g.ClippingRange(near, far), RigidTransform())


def seen(shape, X_WG=None, color=(1.0, 0.0, 0.0, 1.0), label=2, texture=None):
    """A geometry with the perception role."""
    made = g.GeometryInstance(X_WG or RigidTransform(), shape, f"geometry {label}")
    properties = g.PerceptionProperties()
    properties.AddProperty("label", "id", g.RenderLabel(label) if isinstance(label, int) else label)
    if color is not None:
        properties.AddProperty("phong", "diffuse", g.Rgba(*color))
    if texture is not None:
        properties.AddProperty("phong", "diffuse_map", str(texture))
    made.set_perception_properties(properties)
    return made


class Studio:
    """A SceneGraph with a renderer, and things fixed in the world."""

    def __init__(self, *things, engine=None, **params):
        self.scene_graph = g.SceneGraph()
        self.source = self.scene_graph.RegisterSource("studio")
        self.scene_graph.AddRenderer("r", engine or g.MakeRenderEngineVtk(g.RenderEngineVtkParams(**params)))
        self.ids = [self.scene_graph.RegisterAnchoredGeometry(self.source, thing) for thing in things]
        self.context = self.scene_graph.CreateDefaultContext()

    def query(self):
        return self.scene_graph.get_query_output_port().Eval(self.context)

    def colors(self, X_WC, **lens):
        camera = g.ColorRenderCamera(core(**lens))
        return self.query().RenderColorImage(camera, self.scene_graph.world_frame_id(), X_WC).data

    def depths(self, X_WC, least=0.06, most=90.0, **lens):
        camera = g.DepthRenderCamera(core(**lens), g.DepthRange(least, most))
        return self.query().RenderDepthImage(camera, self.scene_graph.world_frame_id(), X_WC).data[..., 0]

    def labels(self, X_WC, **lens):
        camera = g.ColorRenderCamera(core(**lens))
        return self.query().RenderLabelImage(camera, self.scene_graph.world_frame_id(), X_WC).data[..., 0]


# ---- depth by hand: rays o + t d with d = (x, y, 1) in the camera's frame, so that t is the depth


def rays(X_GC, lens=LENS):
    """Origin and directions of all pixels' rays in frame G."""
    v, u = np.indices((lens.height(), lens.width()))
    x, y = (u + 0.5 - lens.center_x()) / lens.focal_x(), (v + 0.5 - lens.center_y()) / lens.focal_y()
    d = np.stack([x, y, np.ones_like(x)], axis=-1)
    return X_GC.translation(), d @ X_GC.rotation().matrix().T


def first(*depths):
    """The nearest of several surfaces in front of the camera, infinity for none."""
    depths = [np.where(np.isfinite(t) & (t > 0.0), t, np.inf) for t in depths]
    return np.minimum.reduce(depths)


def quadratic(a, b, c):
    """Both roots of a t^2 + 2 b t + c = 0, NaN for none."""
    with np.errstate(invalid="ignore", divide="ignore"):
        root = np.sqrt(b * b - a * c)
        return (-b - root) / a, (-b + root) / a


def ellipsoid_depth(X_GC, radii, lens=LENS):
    o, d = rays(X_GC, lens)
    o, d = o / radii, d / radii
    return first(*quadratic((d * d).sum(-1), d @ o, o @ o - 1.0))


def cylinder_depth(X_GC, radius, length, lens=LENS):
    o, d = rays(X_GC, lens)
    hits = quadratic((d[..., :2] ** 2).sum(-1), d[..., :2] @ o[:2], o[:2] @ o[:2] - radius**2)
    hits = [np.where(np.abs(o[2] + t * d[..., 2]) <= length / 2, t, np.inf) for t in hits]
    for z in (-length / 2, length / 2):
        t = (z - o[2]) / d[..., 2]
        inside = ((o[:2] + t[..., None] * d[..., :2]) ** 2).sum(-1) <= radius**2
        hits.append(np.where(inside, t, np.inf))
    return first(*hits)


def capsule_depth(X_GC, radius, length, lens=LENS):
    o, d = rays(X_GC, lens)
    hits = quadratic((d[..., :2] ** 2).sum(-1), d[..., :2] @ o[:2], o[:2] @ o[:2] - radius**2)
    hits = [np.where(np.abs(o[2] + t * d[..., 2]) <= length / 2, t, np.inf) for t in hits]
    for z in (-length / 2, length / 2):
        p = o - [0.0, 0.0, z]
        for t in quadratic((d * d).sum(-1), d @ p, p @ p - radius**2):
            hits.append(np.where((o[2] + t * d[..., 2]) * np.sign(z) >= length / 2, t, np.inf))
    return first(*hits)


def box_depth(X_GC, size, lens=LENS):
    """By slabs; the way out where the camera is inside."""
    o, d = rays(X_GC, lens)
    with np.errstate(divide="ignore"):
        t = np.stack([(side * np.array(size) / 2 - o) / d for side in (-1, 1)])
    enter, leave = t.min(axis=0).max(axis=-1), t.max(axis=0).min(axis=-1)
    hit = np.where(enter > 0.0, enter, leave)
    return np.where((enter <= leave) & (hit > 0.0), hit, np.inf)


def plane_depth(X_GC, lens=LENS):
    """Of a square of 100 m."""
    o, d = rays(X_GC, lens)
    with np.errstate(divide="ignore", invalid="ignore"):
        t = -o[2] / d[..., 2]
        return first(np.where(np.abs(o + t[..., None] * d).max(axis=-1) <= 50.0, t, np.inf))
