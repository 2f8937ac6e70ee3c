"""What was beside the viewer of 2021: contacts, point clouds and triads, drawn into the same page."""

from __future__ import annotations

from typing import Any

from sheldrake.geometry import Cylinder, Meshcat, Rgba
from sheldrake.geometry import MeshcatPointCloudVisualizer as _TodaysPointCloudVisualizer
from sheldrake.math import RigidTransform, RotationMatrix
from sheldrake.multibody.meshcat import ContactVisualizer, ContactVisualizerParams
from sheldrake.systems.framework import InputPort

from .hints import hint

__all__ = ["AddTriad", "MeshcatContactVisualizer", "MeshcatPointCloudVisualizer"]


def _page_of(viewer: Any) -> Meshcat:
    """The page that a viewer draws into; one of its own beside a meshcat-server."""
    return Meshcat() if viewer.meshcat is None else viewer.meshcat


class MeshcatContactVisualizer(ContactVisualizer):
    """Retired: use `ContactVisualizer.AddToBuilder`.

    Args:
        meshcat_viz: The viewer that ConnectMeshcatVisualizer() gave.
        force_threshold: Forces below this are not drawn [N].
        contact_force_scale: Force that an arrow of one metre stands for [N/m].
        plant: Not used: contact results know the names of bodies.
        contact_force_radius: Radius of the arrows' shafts [m].
    """

    def __init__(
        self,
        meshcat_viz: Any,
        force_threshold: float = 1e-2,
        contact_force_scale: float = 10.0,
        plant: Any = None,
        contact_force_radius: float = 0.01,
    ):
        hint("MeshcatContactVisualizer is retired: use ContactVisualizer.AddToBuilder(builder, plant, meshcat).")
        params = ContactVisualizerParams(
            force_threshold=force_threshold, newtons_per_meter=contact_force_scale, radius=contact_force_radius
        )
        super().__init__(_page_of(meshcat_viz), params)


class MeshcatPointCloudVisualizer(_TodaysPointCloudVisualizer):
    """Retired: use `geometry.MeshcatPointCloudVisualizer`.

    Args:
        meshcat_viz: The viewer that ConnectMeshcatVisualizer() gave.
        draw_period: Simulated time between two publishes [s].
        name: Path of the cloud, below that of the viewer.
        X_WP: Pose of the cloud's frame in the world.
        default_rgb: Color of points in clouds without colors, each from 0 to 255.
    """

    def __init__(
        self,
        meshcat_viz: Any,
        draw_period: float = 1 / 30.0,
        name: str = "point_cloud",
        X_WP: RigidTransform | None = None,
        default_rgb: Any = (255.0, 255.0, 255.0),
    ):
        hint("MeshcatPointCloudVisualizer is retired: use geometry.MeshcatPointCloudVisualizer(meshcat, path).")
        page = _page_of(meshcat_viz)
        super().__init__(page, f"{name}/cloud", draw_period)
        self.set_default_rgba(Rgba(*(value / 255.0 for value in default_rgb)))
        page.SetTransform(name, RigidTransform() if X_WP is None else RigidTransform(X_WP))

    def GetInputPort(self, port_name: str) -> InputPort:
        """The input port of a name; the cloud's was "point_cloud_P"."""
        return super().GetInputPort("cloud" if port_name == "point_cloud_P" else port_name)


def AddTriad(vis: Any, name: str, prefix: str, length: float = 1.0, radius: float = 0.04, opacity: float = 1.0) -> None:
    """Retired: use `visualization.AddFrameTriadIllustration`. Draws the axes of a frame, red, green and blue.

    Args:
        vis: The viewer's `vis`.
        name: Name of the triad.
        prefix: Path above it.
        length: Of the axes [m].
        radius: Of the axes [m].
        opacity: From 0 to 1.
    """
    hint("AddTriad() is retired: use AddFrameTriadIllustration().")
    set_object, set_transform = (
        (vis.SetObject, vis.SetTransform) if isinstance(vis, Meshcat) else (vis.set_object, _sends_poses(vis))
    )
    turns = (RotationMatrix.MakeYRotation(1.5707963267948966), RotationMatrix.MakeXRotation(-1.5707963267948966))
    for i, R_TA in enumerate((*turns, RotationMatrix())):
        path = f"{prefix}/{name}/{'xyz'[i]}-axis"
        set_object(path, Cylinder(radius, length), Rgba(float(i == 0), float(i == 1), float(i == 2), opacity))
        set_transform(path, RigidTransform(R_TA, [length / 2 if i == k else 0.0 for k in range(3)]))


def _sends_poses(server: Any) -> Any:
    return lambda path, X: server.set_transform(path, X.GetAsMatrix34())
