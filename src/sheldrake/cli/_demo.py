"""A part falls on the ground: page, trajectory, plot and replay are what it leaves.

Without a model it drops our block. The page opens by itself where there is a browser; the part falls once somebody
looks, slowly enough to be seen, and the page keeps the replay until Ctrl-C.

examples:
  sheldrake demo                   a block with two holes
  sheldrake demo part.urdf         your own part, from a height that fits it
  sheldrake demo part.stl          the same, as a solid of water's density (`sheldrake mesh2urdf` makes it of others)
  sheldrake demo --headless        no page: as fast as possible
"""

from __future__ import annotations

import argparse
import contextlib
import os
import pathlib
import sys
import time
import webbrowser
from typing import TYPE_CHECKING, Any

import numpy as np

import sheldrake
from sheldrake.cli._output import add_json, reporting

if TYPE_CHECKING:
    from sheldrake.geometry._meshcat.meshcat import Meshcat
    from sheldrake.geometry._scene_graph import SceneGraph

_PATIENCE = 20.0  # how long it waits for the first page [s]
_DRAWING = 60.0  # how long, once somebody has come, for the page to draw the scene [s]
_FALL, _IMPACT = 1.5, 5.0  # how long a person sees the part fall, and hit the ground, at least [s]
_AFTER = 1.0  # how long the replay goes on when it rests [s]
_PUBLISH_PERIOD = 4e-3  # [s]; in slow motion still many pictures a second


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declares what `sheldrake demo` takes."""
    parser.add_argument("model", nargs="?", help="a model that floats, its name, or a mesh (default: our block)")
    parser.add_argument("--headless", action="store_true", help="no page: as fast as possible, and end")
    parser.add_argument("--no-browser", action="store_true", help="leave it to you to open the page")
    parser.add_argument("--seconds", type=float, default=15.0, help="simulated time [s] (default: 15)")
    add_json(parser, "files, and how it ended")
    parser.add_argument("--out", default="sheldrake-demo", help="folder for the files (default: sheldrake-demo)")


def run(options: argparse.Namespace) -> int:
    """Drops the part and writes the files; returns the exit status."""
    with reporting(options) as told:
        return _run(options, told)


def _run(options: argparse.Namespace, told: dict[str, Any]) -> int:
    from sheldrake.cli._mesh2urdf import part_of
    from sheldrake.cli._model_names import find_model
    from sheldrake.cli._warnings import warnings_in_one_line

    if not 0.0 < options.seconds < np.inf:
        print(f"sheldrake demo: --seconds must be positive and finite, not {options.seconds:g}.", file=sys.stderr)
        return 2
    start = time.perf_counter()
    print("Making it ready to fall; the first time this may take a minute.", file=sys.stderr)
    try:
        model = part_of(find_model(options.model or "two_hole_block"), options.out)
        if options.model:
            _consult(model)
        with warnings_in_one_line(model):
            scene = _Scene(model)
    except (OSError, RuntimeError, ValueError) as error:
        print(f"sheldrake demo: {error}", file=sys.stderr)
        return 1
    try:
        rehearsal = scene.rehearse(options.seconds)
        if not options.headless:
            _invite(scene.meshcat, opens=not options.no_browser)
        took = scene.play(rehearsal, options.seconds, slowly=not options.headless)
        told |= _write(scene, pathlib.Path(options.out), options.seconds, took)
        if not told["at_rest"]:
            print(scene.why())
        print(f"Done in {time.perf_counter() - start:.1f} s.", flush=True)
        if not options.headless:
            _stay(scene.meshcat)
    except OSError as error:
        print(f"sheldrake demo: nothing can be written to '{options.out}': {error.strerror}.", file=sys.stderr)
        return 1
    except RuntimeError as error:
        print(f"sheldrake demo: the run fails: {error}", file=sys.stderr)
        print(scene.why(), file=sys.stderr)
        return 1
    return 0


def _consult(model: str) -> None:
    """Says first what is wrong with a model: what follows is the model's doing."""
    from sheldrake.cad import DiagnoseModel

    if not model.lower().endswith((".urdf", ".sdf", ".xml")) or not os.path.isfile(model):
        return
    errors = DiagnoseModel(model).errors()
    for finding in errors:
        print(finding, file=sys.stderr)
    if any(finding.is_fixable for finding in errors):
        print(f"mended by: sheldrake doctor {model} --fix FILE", file=sys.stderr)


class _Scene:
    """A part above the ground, ready to fall.

    Args:
        model: The file of the part.

    Raises:
        RuntimeError: when the file cannot be read.
        ValueError: when nothing in it floats.
    """

    def __init__(self, model: str):
        from sheldrake.geometry import HalfSpace, Meshcat, MeshcatVisualizer, MeshcatVisualizerParams
        from sheldrake.math import RigidTransform
        from sheldrake.multibody.parsing import Parser
        from sheldrake.multibody.plant import AddMultibodyPlantSceneGraph, CoulombFriction
        from sheldrake.systems.framework import DiagramBuilder
        from sheldrake.systems.primitives import LogVectorOutput

        builder = DiagramBuilder()
        self.plant, scene_graph = AddMultibodyPlantSceneGraph(builder, time_step=1e-3)
        plant = self.plant
        instances = Parser(plant).AddModels(model)
        ground, X_WG = HalfSpace(), RigidTransform()
        plant.RegisterCollisionGeometry(plant.world_body(), X_WG, ground, "ground_collision", CoulombFriction(0.7, 0.5))
        plant.RegisterVisualGeometry(plant.world_body(), X_WG, ground, "ground_visual", [0.55, 0.6, 0.65, 1.0])
        plant.Finalize()
        floating = [plant.get_body(index) for index in sorted(plant.GetFloatingBaseBodies())]
        if not floating:
            raise ValueError(f"nothing in {model} floats: all of it is welded to the world, so nothing can fall.")
        self.body, instance = floating[0], instances[0]
        is_ours = model == sheldrake.model_path("two_hole_block/two_hole_block.urdf")
        self.name = "block" if is_ours else plant.GetModelInstanceName(instance)
        self.state_names = plant.GetStateNames(instance)
        self.logger = LogVectorOutput(plant.get_state_output_port(instance), builder)
        self.meshcat = Meshcat()
        params = MeshcatVisualizerParams(publish_period=_PUBLISH_PERIOD, delete_on_initialization_event=False)
        MeshcatVisualizer.AddToBuilder(builder, scene_graph, self.meshcat, params)
        self.diagram = builder.Build()
        self.context = self.diagram.CreateDefaultContext()
        self._lift(scene_graph)

    def _lift(self, scene_graph: SceneGraph) -> None:
        """Turns the part a little and places it above the ground, three times its size."""
        from sheldrake.math import RigidTransform, RollPitchYaw

        plant, rotation = self.plant, RollPitchYaw(0.3, 0.2, 0.1)
        context = plant.GetMyMutableContextFromRoot(self.context)
        plant.SetFreeBodyPose(context, self.body, RigidTransform(rotation, [0.0, 0.0, 0.0]))
        query = scene_graph.get_query_output_port().Eval(scene_graph.GetMyContextFromRoot(self.context))
        corners = [
            box.pose() @ (np.array([x, y, z]) * box.half_width())
            for geometry in query.inspector().GetAllGeometryIds()
            if (box := query.ComputeObbInWorld(geometry)) is not None
            for x in (-1, 1)
            for y in (-1, 1)
            for z in (-1, 1)
        ]
        points = np.array(corners) if corners else np.zeros((1, 3))
        self.size = float(np.linalg.norm(np.ptp(points, axis=0)))
        height = 3.0 * self.size - float(points[:, 2].min())
        plant.SetFreeBodyPose(context, self.body, RigidTransform(rotation, [0.0, 0.0, height]))

    def why(self) -> str:
        """Says why the last run went wrong."""
        from sheldrake.cad import ExplainFailure

        return ExplainFailure(self.simulator)

    def rehearse(self, seconds: float) -> tuple[float, float]:
        """Lets a copy fall, out of sight; returns when it first touches something and when it comes to rest [s].

        Kernels that are not compiled yet are compiled here, before any clock runs.
        """
        from sheldrake.systems.analysis import Simulator

        self.simulator = simulator = Simulator(self.diagram, self.context.Clone())
        simulator.AdvanceTo(seconds)
        self.diagram.ForcedPublish(self.context)  # the page shows where it starts
        log = self.logger.FindLog(simulator.get_context())
        times = log.sample_times()
        speed = np.abs(log.data()[self.plant.num_positions() :]).max(axis=0, initial=0.0)
        slowed = np.flatnonzero(np.diff(speed) < 0.0)
        moves = np.flatnonzero(speed > 1e-3 * speed.max(initial=0.0))
        impact = float(times[slowed[0]]) if len(slowed) else seconds
        return impact, max(impact, float(times[moves[-1]]) if len(moves) else 0.0)

    def play(self, rehearsal: tuple[float, float], seconds: float, slowly: bool) -> float:
        """Lets the part fall and records it; returns the seconds it took.

        Args:
            rehearsal: When it touches the ground and when it rests [s].
            seconds: When to end [s].
            slowly: Whether for eyes: the fall and the impact in slow motion, then in real time.
        """
        from sheldrake.systems.analysis import Simulator

        impact, rest = rehearsal
        self.simulator, meshcat, start = Simulator(self.diagram, self.context), self.meshcat, time.perf_counter()
        self.simulator.Initialize()
        meshcat.StartRecording()
        before = 0.0
        for end, least in ((impact, _FALL), (rest, _IMPACT), (rest + _AFTER, 0.0), (seconds, 0.0)):
            if before >= rest + _AFTER:
                meshcat.StopRecording()  # a replay of nothing that moves is tedious
            end = min(end, seconds)
            if slowly and end > before:
                rate = min(1.0, (end - before) / least) if least else 1.0
                self.simulator.set_target_realtime_rate(rate)
                self.simulator.ResetStatistics()
                meshcat.SetRealtimeRate(rate)
            self.simulator.AdvanceTo(end)
            before = end
        meshcat.StopRecording()
        meshcat.PublishRecording()
        return time.perf_counter() - start


def _invite(meshcat: Meshcat, opens: bool) -> None:
    """Says where the page is, opens it where there is a browser, and waits until somebody looks, for a while."""
    print(f"Watch it at {meshcat.web_url()}", flush=True)
    if opens and _has_screen():
        webbrowser.open(meshcat.web_url())
    deadline, connected = time.monotonic() + _PATIENCE, False
    print(f"It falls when the page is open, or in {_PATIENCE:g} s.", flush=True)
    while time.monotonic() < deadline and not meshcat._is_shown():
        if meshcat.GetNumActiveConnections() and not connected:
            connected, deadline = True, time.monotonic() + _DRAWING
        time.sleep(0.05)


def _has_screen() -> bool:
    """Whether a browser can be shown: not at the other end of an ssh connection, nor without a screen."""
    if sys.platform.startswith("linux"):
        return bool(os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY"))
    return "SSH_CONNECTION" not in os.environ


def _stay(meshcat: Meshcat) -> None:
    """Keeps the page and its replay until Ctrl-C, where somebody looks or could."""
    if not (meshcat.GetNumActiveConnections() or sys.stdout.isatty()):
        return
    from sheldrake.common._ctrl_c import deferred_ctrl_c

    print(f"The page {meshcat.web_url()} replays it as often as you like; Ctrl-C ends it.", flush=True)
    with deferred_ctrl_c() as check, contextlib.suppress(KeyboardInterrupt):
        while True:
            check()
            time.sleep(0.05)


def _write(scene: _Scene, out: pathlib.Path, seconds: float, took: float) -> dict[str, Any]:
    """Writes trajectory, plot and replay, and says how the part ended, to programs by what it returns."""
    out.mkdir(parents=True, exist_ok=True)
    name, log = scene.name, scene.logger.FindLog(scene.simulator.get_context())
    log.ToNpz(out / f"{name}.npz")
    log.ToCsv(out / f"{name}.csv")
    _plot(log, scene.state_names, out / f"{name}.png")
    (out / f"{name}.html").write_text(scene.meshcat.StaticHtml(), encoding="utf-8")
    speed = float(np.abs(log.data()[scene.plant.num_positions() :, -1]).max(initial=0.0))
    rest = "at rest" if speed < 1e-6 else f"still moving at {speed:.2g} (rad/s or m/s)"
    print(f"{seconds:g} s simulated in {took:.2f} s; {log.num_samples()} samples; the {name} is {rest}.")
    files = {
        str(out / f"{name}.npz"): "trajectory, NumPy",
        str(out / f"{name}.csv"): "trajectory, text",
        str(out / f"{name}.png"): "plot",
        str(out / f"{name}.html"): "replay, opens without a network",
    }
    for file, what in files.items():
        print(f"  {file:28} {what}")
    return {
        "files": list(files),
        "seconds": seconds,
        "samples": log.num_samples(),
        "speed": speed,
        "at_rest": rest == "at rest",
    }


def _plot(log: Any, names: list[str], path: pathlib.Path) -> None:
    import matplotlib

    matplotlib.use("Agg")
    from sheldrake.visualization import PlotLog

    PlotLog(log, state_names=names).savefig(path, dpi=120)
