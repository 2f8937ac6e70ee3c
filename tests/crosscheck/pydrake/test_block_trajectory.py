"""A tilted block falls, hits the ground and tumbles on single points: the step kernel against Drake, step by step."""

from __future__ import annotations

import itertools
import pathlib
import xml.etree.ElementTree as ElementTree

import numpy as np
import pytest

pytest.importorskip("pydrake")

from drake_problem import approximation
from tests.unit.multibody.plant.free_bodies import FreeBodies, box_inertia

from sheldrake import geometry as g

pytestmark = pytest.mark.peer

ROOT = pathlib.Path(__file__).parents[3]
SLIDER = ROOT.parent / "shared" / "models" / "slider"
"""The article's own files, where they are present."""

if not SLIDER.exists():
    SLIDER = ROOT.parents[1] / "shared" / "models" / "slider"

NAMES = ("lagged", "similar", "sap", "tamsi")
SIZE = [0.2, 0.1, 0.06]


def drakes_states(name, build, seconds, z):
    """States of a body named "body" that starts tilted, one a step."""
    from pydrake.geometry import HalfSpace
    from pydrake.math import RigidTransform, RollPitchYaw
    from pydrake.multibody.plant import AddMultibodyPlantSceneGraph, CoulombFriction
    from pydrake.systems.analysis import Simulator
    from pydrake.systems.framework import DiagramBuilder
    from pydrake.systems.primitives import LogVectorOutput

    builder = DiagramBuilder()
    plant, _ = AddMultibodyPlantSceneGraph(builder, 1e-3)
    plant.set_discrete_contact_approximation(approximation(name))
    build(plant)
    ground = HalfSpace()
    plant.RegisterCollisionGeometry(plant.world_body(), RigidTransform(), ground, "g", CoulombFriction(0.7, 0.5))
    plant.Finalize()
    log = LogVectorOutput(plant.get_state_output_port(), builder)
    diagram = builder.Build()
    context = diagram.CreateDefaultContext()
    own = plant.GetMyMutableContextFromRoot(context)
    plant.SetFreeBodyPose(own, plant.GetBodyByName("body"), RigidTransform(RollPitchYaw(0.3, 0.2, 0.1), [0, 0, z]))
    simulator = Simulator(diagram, context)
    simulator.Initialize()
    simulator.AdvanceTo(seconds)
    return log.FindLog(context).data().T.copy()


def compare(ours, drakes):
    """(worst difference up to 60 steps after the first contact, worst difference of q and p of all)."""
    fall = np.abs(np.diff(drakes[:, 12]) + 9.81e-3)
    first = int(np.argmax(fall > 1e-6))
    assert first > 10
    difference = np.abs(ours - drakes)
    return difference[: first + 60].max(), difference[:, :7].max()


def run(scene, drakes):
    scene.x[:] = drakes[0]
    return np.vstack([drakes[0], scene.step(len(drakes) - 1)])


@pytest.mark.parametrize("name", NAMES)
def test_a_box_of_our_own(name):
    def build(plant):
        from pydrake.geometry import Box
        from pydrake.math import RigidTransform
        from pydrake.multibody.plant import CoulombFriction
        from pydrake.multibody.tree import SpatialInertia

        body = plant.AddRigidBody("body", SpatialInertia.SolidBoxWithMass(1.5, *SIZE))
        plant.RegisterCollisionGeometry(body, RigidTransform(), Box(*SIZE), "box", CoulombFriction(1.0, 1.0))

    drakes = drakes_states(name, build, 1.0, 0.2)
    box = (g.Box(*SIZE), 1.5, [0.0, 0.0, 0.0], box_inertia(1.5, SIZE))
    scene = FreeBodies([box], approximation=name, algorithm="single_point", mu=1.0, ground_mu=0.5)
    early, _ = compare(run(scene, drakes), drakes)
    assert early < 1e-9
    # A box lying on single points chatters, and round-off grows: later, every step is checked on its own.
    for before, after in itertools.pairwise(drakes):
        scene.x[:] = before
        np.testing.assert_allclose(scene.step()[0], after, rtol=0, atol=1e-12)


@pytest.mark.skipif(not SLIDER.exists(), reason="the article's files are not part of the project")
@pytest.mark.parametrize("name", NAMES)
def test_the_articles_block(name):
    def build(plant):
        from pydrake.multibody.parsing import Parser

        Parser(plant).AddModels(str(SLIDER / "slider-block.urdf"))

    drakes = drakes_states(name, build, 3.0, 0.1)
    inertial = ElementTree.parse(SLIDER / "slider-block.urdf").getroot().find("link/inertial")
    origin = inertial.find("origin")
    c = [float(x) for x in origin.get("xyz").split()] if origin is not None else [0.0, 0.0, 0.0]
    i = {k: float(v) for k, v in inertial.find("inertia").attrib.items()}
    I_BBcm = [[i["ixx"], i["ixy"], i["ixz"]], [i["ixy"], i["iyy"], i["iyz"]], [i["ixz"], i["iyz"], i["izz"]]]
    mesh = g.Mesh(str(SLIDER / "SliderBlockv3.obj"), 0.001)
    block = (mesh, float(inertial.find("mass").get("value")), c, I_BBcm)
    scene = FreeBodies([block], approximation=name, algorithm="single_point", mu=1.0, ground_mu=0.5)
    early, late = compare(run(scene, drakes), drakes)
    assert early < 1e-9
    assert late < 1e-6


def test_wrong_stiffness_is_seen():
    def build(plant):
        from pydrake.geometry import Sphere
        from pydrake.math import RigidTransform
        from pydrake.multibody.plant import CoulombFriction
        from pydrake.multibody.tree import SpatialInertia

        body = plant.AddRigidBody("body", SpatialInertia.SolidBoxWithMass(1.5, *SIZE))
        plant.RegisterCollisionGeometry(body, RigidTransform(), Sphere(0.05), "ball", CoulombFriction(1.0, 1.0))

    drakes = drakes_states("lagged", build, 0.3, 0.1)
    ball = (g.Sphere(0.05), 1.5, [0.0, 0.0, 0.0], box_inertia(1.5, SIZE))
    for factor, ok in ((1.0, True), (1.001, False)):
        scene = FreeBodies([ball], algorithm="single_point", mu=1.0, ground_mu=0.5)
        scene.geometry.material[0, 0] *= factor
        early, _ = compare(run(scene, drakes), drakes)
        assert (early < 1e-9) == ok
