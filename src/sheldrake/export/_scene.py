"""What a page draws of a frozen diagram: bodies of plants, where their poses are computed, and how they are pulled."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from sheldrake.export._freeze import Freezer
from sheldrake.multibody.plant import MultibodyPlant
from sheldrake.multibody.plant._parts import parts_of
from sheldrake.multibody.tree._kernels.kinematics import position_kinematics
from sheldrake.multibody.tree._kernels.model import make_work
from sheldrake.multibody.tree._kernels.queries import calc_generalized_forces
from sheldrake.report._replay import camera_of, drawn, find_scene_graph, numbers_of, query_of
from sheldrake.systems.framework._diagram import all_systems

if TYPE_CHECKING:
    from sheldrake.geometry._meshcat.meshcat import Meshcat


class Scene:
    """The drawn scene of a diagram.

    Attributes:
        html: A page that shows it and takes poses; "" where there is nothing to see.
        description: Frames by path, their plants and rows; camera.
    """

    def __init__(self, freezer: Freezer, meshcat: Meshcat | None):
        self.html = ""
        self.description: dict = {"plants": [], "frames": [], "camera": None}
        diagram = freezer.simulator.get_system()
        context = freezer.simulator.get_context().Clone()  # what is computed to draw is not in the page
        graph = find_scene_graph(diagram)
        if graph is None:
            return
        plants = [s for s in all_systems(diagram) if isinstance(s, MultibodyPlant)]
        query = query_of(graph, context)
        with drawn(diagram, meshcat, query) as (page, html, frames, paths):
            self.html = html
            self.description["frames"] = [
                {"path": path, **_owner(plants, frame, path)} for frame, path in zip(frames, paths)
            ]
            poses = numbers_of(query._world_matrices(frames, {}))[None]
            camera = camera_of(page, paths, poses) if paths else None
            self.description["camera"] = None if camera is None else camera.tolist()
        self.description["plants"] = [_plant(freezer, plant, k) for k, plant in enumerate(plants)]


def _owner(plants: list[Any], frame: Any, path: str) -> dict[str, Any]:
    """Which body of which plant a frame is, and where the positions of a free one begin."""
    for k, plant in enumerate(plants):
        body = plant.GetBodyFromFrameId(frame)
        if body is not None:
            free = body.is_floating_base_body() and body.has_quaternion_dofs()
            return {
                "plant": k,
                "row": int(parts_of(plant).elements.row_of(body)),
                "free": body.floating_positions_start() if free else -1,
                "mass": body.default_mass(),
            }
    raise ValueError(f"SavePage(): '{path}' is moved by no MultibodyPlant; only bodies of plants can move in a page.")


def _plant(freezer: Freezer, plant: MultibodyPlant, k: int) -> dict[str, Any]:
    """Has the frozen diagram compute the poses of a plant's bodies, and generalized forces of forces on them."""
    layout, store = freezer.layout, freezer.store
    place = layout.places[layout.node_of[plant._system_id]]
    begin = (place.xd if plant.is_discrete() else place.xc)[0]
    nq, nv = plant.num_positions(), plant.num_velocities()
    tree = parts_of(plant).elements.model("SavePage").tree
    work, F = make_work(tree), np.zeros((len(tree.body), 6))
    p, q = store.S[slice(*place.p)], store.S[begin : begin + nq]
    freezer.add_call(f"poses {k}", position_kinematics, (tree, p, work, q))
    about = {
        "poses": freezer.image.place(work.X_WB) // 8,
        "q": begin,
        "v": begin + nq,
        "num_v": nv,
        "num_bodies": len(F),
        "forces": freezer.image.place(F) // 8 if nv else -1,
        "tau": -1,
    }
    slot = place.inputs[parts_of(plant).inputs.generalized_force]
    if slot.free >= 0 and nv:
        tau = store.S[slice(*slot.span)]
        freezer.add_call(f"forces {k}", calc_generalized_forces, (tree, work, F, tau))
        about["tau"] = slot.span[0]
    return about
