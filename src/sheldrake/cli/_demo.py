"""`sheldrake demo`: a block falls on the ground; page, trajectory, plot and replay are what it leaves."""

from __future__ import annotations

import argparse
import pathlib
import time

import sheldrake


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declares what `sheldrake demo` takes."""
    parser.add_argument("model", nargs="?", help="a model with one free body (default: our block)")
    parser.add_argument("--headless", action="store_true", help="as fast as possible, and end without waiting")
    parser.add_argument("--seconds", type=float, default=15.0, help="simulated time [s] (default: 15)")
    parser.add_argument("--out", default="sheldrake-demo", help="folder for the files (default: sheldrake-demo)")


def run(options: argparse.Namespace) -> int:
    """Drops the block and writes the files; returns the exit status."""
    start = time.perf_counter()
    out = pathlib.Path(options.out)
    out.mkdir(parents=True, exist_ok=True)
    model = options.model or sheldrake.model_path("two_hole_block/two_hole_block.urdf")
    simulator, meshcat, logger, names = _scene(model)
    visualizer_time = time.perf_counter()
    if not options.headless:
        print(f"Watch it at {meshcat.web_url()}", flush=True)
        simulator.set_target_realtime_rate(1.0)
        meshcat.SetRealtimeRate(1.0)
    meshcat.StartRecording()
    simulator.AdvanceTo(options.seconds)
    meshcat.StopRecording()
    meshcat.PublishRecording()
    took = time.perf_counter() - visualizer_time

    log = logger.FindLog(simulator.get_context())
    log.ToNpz(out / "block.npz")
    log.ToCsv(out / "block.csv")
    _plot(log, names, out / "block.png")
    (out / "block.html").write_text(meshcat.StaticHtml(), encoding="utf-8")
    state = log.data()[:, -1]
    speed = float(abs(state[7:13]).max())
    rest = "at rest" if speed < 1e-6 else f"still moving at {speed:.2g} (rad/s or m/s)"
    print(f"{options.seconds:g} s simulated in {took:.2f} s; {log.num_samples()} samples; the block is {rest}.")
    for name, what in (
        ("block.npz", "trajectory, NumPy"),
        ("block.csv", "trajectory, text"),
        ("block.png", "plot"),
        ("block.html", "replay, opens without a network"),
    ):
        print(f"  {out / name!s:28} {what}")
    print(f"Done in {time.perf_counter() - start:.1f} s.")
    return 0


def _scene(model: str):
    from sheldrake.geometry import HalfSpace, Meshcat, MeshcatVisualizer
    from sheldrake.math import RigidTransform, RollPitchYaw
    from sheldrake.multibody.parsing import Parser
    from sheldrake.multibody.plant import AddMultibodyPlantSceneGraph, CoulombFriction
    from sheldrake.systems.analysis import Simulator
    from sheldrake.systems.framework import DiagramBuilder
    from sheldrake.systems.primitives import LogVectorOutput

    builder = DiagramBuilder()
    plant, scene_graph = AddMultibodyPlantSceneGraph(builder, time_step=1e-3)
    (block,) = Parser(plant).AddModels(model)
    ground, X_WG = HalfSpace(), RigidTransform()
    plant.RegisterCollisionGeometry(plant.world_body(), X_WG, ground, "ground_collision", CoulombFriction(0.7, 0.5))
    plant.RegisterVisualGeometry(plant.world_body(), X_WG, ground, "ground_visual", [0.55, 0.6, 0.65, 1.0])
    plant.Finalize()
    logger = LogVectorOutput(plant.get_state_output_port(block), builder)
    meshcat = Meshcat()
    MeshcatVisualizer.AddToBuilder(builder, scene_graph, meshcat)
    diagram = builder.Build()
    context = diagram.CreateDefaultContext()
    (body,) = (plant.get_body(i) for i in plant.GetFloatingBaseBodies())
    X_WB = RigidTransform(RollPitchYaw(0.3, 0.2, 0.1), [0.0, 0.0, 0.1])
    plant.SetFreeBodyPose(plant.GetMyContextFromRoot(context), body, X_WB)
    simulator = Simulator(diagram, context)
    simulator.Initialize()
    return simulator, meshcat, logger, plant.GetStateNames(block)


def _plot(log, names: list[str], path: pathlib.Path) -> None:
    import matplotlib

    matplotlib.use("Agg")
    from sheldrake.visualization import PlotLog

    PlotLog(log, state_names=names).savefig(path, dpi=120)
