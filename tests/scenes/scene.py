"""The scene of the article, built alike with sheldrake and with pydrake."""

from __future__ import annotations

import pathlib
import types

import numpy as np
from tests.libraries import names_of

ROOT = pathlib.Path(__file__).resolve().parents[2]
SLIDER = ROOT.parent / "shared" / "models" / "slider" / "slider-block.urdf"
"""The article's own files, where they are present; the project ships models of its own making."""


def library(name: str) -> types.SimpleNamespace:
    """The names the scene needs, from package `name`: "sheldrake" or "pydrake"."""
    multibody = ("multibody.math", "multibody.parsing", "multibody.plant")
    systems = ("systems.analysis", "systems.framework", "systems.primitives")
    return names_of(name, "geometry", "math", *multibody, *systems)


def drop(
    lib: types.SimpleNamespace,
    urdf: str,
    rpy=(0.3, 0.2, 0.1),
    height: float = 0.1,
    time_step: float = 1e-3,
    approximation: str | None = None,
    algorithm: str | None = None,
    meshcat: object = None,
):
    """The block above its ground, ready to go.

    Args:
        lib: what `library` returns.
        urdf: file of a model whose only link is called body.
        rpy: roll, pitch, yaw of the block at the start [rad].
        height: height of the block's origin at the start [m].
        approximation: a name of `DiscreteContactApproximation`, such as "kLagged".
        algorithm: "single_point" or "multi_point", set on the ground; sheldrake only.
        meshcat: publish to it at 64 Hz when given.

    Returns:
        simulator, log sink, plant, model instance.
    """
    builder = lib.DiagramBuilder()
    plant, scene_graph = lib.AddMultibodyPlantSceneGraph(builder, time_step)
    if approximation:
        plant.set_discrete_contact_approximation(getattr(lib.DiscreteContactApproximation, approximation))
    (model,) = lib.Parser(plant).AddModels(urdf)
    X_WG = lib.HalfSpace.MakePose([0, 0, 1], [0, 0, 0])
    properties = lib.ProximityProperties()
    lib.AddContactMaterial(properties=properties, friction=lib.CoulombFriction(0.7, 0.5))
    if algorithm:
        properties.AddProperty("material", "point_contact_algorithm", algorithm)
    plant.RegisterCollisionGeometry(plant.world_body(), X_WG, lib.HalfSpace(), "ground_collision", properties)
    plant.RegisterVisualGeometry(plant.world_body(), X_WG, lib.HalfSpace(), "ground_visual", [0.5, 0.5, 0.5, 1.0])
    plant.Finalize()
    sink = lib.LogVectorOutput(plant.get_state_output_port(model), builder)
    sink.set_name("state logger")
    if meshcat is not None:
        lib.MeshcatVisualizer.AddToBuilder(builder, scene_graph, meshcat)
    diagram = builder.Build()
    context = diagram.CreateDefaultContext()
    plant_context = plant.GetMyContextFromRoot(context)
    body = plant.GetBodyByName("body", model)
    X_WB = lib.RigidTransform(lib.RollPitchYaw(np.array(rpy)), np.array([0.0, 0.0, height]))
    plant.SetFreeBodyPose(plant_context, body, X_WB)
    plant.SetFreeBodySpatialVelocity(plant_context, body, lib.SpatialVelocity(np.zeros(3), np.zeros(3)))
    simulator = lib.Simulator(diagram, context)
    simulator.Initialize()
    return simulator, sink, plant, model


def trajectory(lib: types.SimpleNamespace, urdf: str, until: float, **options):
    """Sample times [s], shape (n,), and states [q; v], shape (13, n), of the falling block."""
    simulator, sink, *_ = drop(lib, urdf, **options)
    simulator.AdvanceTo(until)
    log = sink.FindLog(simulator.get_context())
    return log.sample_times().copy(), log.data().copy()
