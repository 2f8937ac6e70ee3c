"""Bodies with flat faces come to rest, and stay."""

from __future__ import annotations

import pathlib
import xml.etree.ElementTree as ElementTree

import numpy as np
import pytest
from benchmarks import contact
from benchmarks.engines import DrakeLike, Scene, Solid
from tests.unit.multibody.plant.free_bodies import FreeBodies, box_inertia, random_quaternion

from sheldrake import geometry as g
from sheldrake.math import RollPitchYaw, RotationMatrix

ROOT = pathlib.Path(__file__).parents[2]
BLOCK = ROOT / "src" / "sheldrake" / "models" / "two_hole_block"


def two_hole_block():
    """(shape, mass, centre of mass, inertia) as the model's URDF has them."""
    inertial = ElementTree.parse(BLOCK / "two_hole_block.urdf").getroot().find("link/inertial")
    i = {k: float(v) for k, v in inertial.find("inertia").attrib.items()}
    I_BBcm = [[i["ixx"], i["ixy"], i["ixz"]], [i["ixy"], i["iyy"], i["iyz"]], [i["ixz"], i["iyz"], i["izz"]]]
    c = [float(x) for x in inertial.find("origin").get("xyz").split()]
    mesh = g.Mesh(str(BLOCK / "two_hole_block.obj"), 0.001)
    return mesh, float(inertial.find("mass").get("value")), c, I_BBcm


@pytest.mark.parametrize("approximation", ["lagged", "similar"])
@pytest.mark.parametrize("seed", [3, 5])
def test_a_heap_of_light_and_heavy_boxes_is_solved_with_long_steps(approximation, seed):
    """Masses from 10 g to 10 kg in random order, 10 ms: some steps take more than Drake's 100 iterations.

    Light boxes may be thrown out, and take their time.
    """
    rng, solids = np.random.default_rng(seed), [Solid(("half_space",))]
    for k in range(20):
        mass = 10.0 ** rng.uniform(-2, 1)
        p = (*rng.uniform(-0.05, 0.05, 2), 0.1 + 0.1 * k)
        solids.append(Solid(("box", 0.08, 0.07, 0.06), mass, p=p, rpy=tuple(rng.uniform(-1, 1, 3))))
    heap = DrakeLike("sheldrake", approximation)
    heap.start(Scene(solids, time_step=1e-2))
    heap.advance(10.0)
    assert np.abs(heap.velocities()[:, 3:]).max() < 0.05
    assert heap.depth_and_contacts()[0] < 1e-3


@pytest.mark.parametrize("approximation", ["lagged", "similar", "sap"])
@pytest.mark.parametrize(("seed", "dt", "masses"), [(1, 5e-3, 4.0), (2, 2e-3, 4.0), (3, 1e-2, 6.0)])
def test_a_pile_of_all_shapes_and_masses_stays_where_it_is(approximation, seed, dt, masses):
    """Sizes 1 to 10, masses up to 1e6 to 1: light bodies are squeezed, thrown out, spinning by radians a step.

    With all of their gyroscopic torque they spin infinitely fast in less than two seconds, as Drake's do.
    """
    rng, solids = np.random.default_rng(seed), [Solid(("half_space",))]
    for k in range(40):
        size, mass = np.exp(rng.uniform(np.log(0.03), np.log(0.3))), 10.0 ** rng.uniform(-0.5 * masses, 0.5 * masses)
        box = ("box", *(size * rng.uniform(0.6, 1.4, 3)))
        shape = [box, ("sphere", 0.5 * size), ("cylinder", 0.4 * size, size)][k % 3]
        p = (*rng.uniform(-0.15, 0.15, 2), 0.2 + 0.25 * k)
        solids.append(Solid(shape, mass, p=p, rpy=tuple(rng.uniform(-3, 3, 3))))
    pile = DrakeLike("sheldrake", approximation)
    pile.start(Scene(solids, time_step=dt))
    pile.advance(4.0)
    v, z = pile.velocities(), pile.positions()[:, 2]
    assert np.isfinite(v).all() and np.median(np.abs(v)) < 1.0
    assert z.min() > -0.1


@pytest.mark.parametrize("approximation", ["lagged", "similar"])
def test_a_heap_of_thirty_boxes_rests(approximation):
    """They hardly creep: with a regularization of friction that does not shrink, half are faster than 3e-5 m/s.

    Three heaps that fall differently, as rounding would have it: one may still have a box that slides off another.
    """
    speeds, moved = [], []
    for shift in (0.0, 1e-9, 2e-9):
        scene = contact.scene("pile")
        scene.solids[10].p = (scene.solids[10].p[0] + shift, *scene.solids[10].p[1:])
        heap = DrakeLike("sheldrake", approximation)
        heap.start(scene)
        heap.advance(10.0)
        speeds.append(np.median(np.abs(heap.velocities()[:, 3:]).max(axis=1)))
        before = heap.positions()
        heap.advance(1.0)
        moved.append(np.median(np.abs(heap.positions() - before).max(axis=1)))
    assert np.median(speeds) < 1e-5
    assert np.median(moved) < 1e-5


@pytest.mark.parametrize("approximation", ["lagged", "similar", "sap"])
def test_the_two_hole_block_rests(approximation):
    """Last 5 of 15 s below 1e-9."""
    rng = np.random.default_rng(0)
    for q in ([0.5**0.5, 0.5**0.5, 0.0, 0.0], random_quaternion(rng), random_quaternion(rng)):
        scene = FreeBodies([two_hole_block()], approximation=approximation, mu=1.0)
        scene.q[0, :4], scene.q[0, 6] = q, 0.1
        states = scene.step(15000)
        assert np.abs(states[10000:, 7:]).max() < 1e-9
        assert scene.work.problem.num_contacts >= 3


def test_a_hundred_cubes_rest_on_a_face():
    rng = np.random.default_rng(0)
    cube = (g.Box(0.1, 0.1, 0.1), 1.0, [0.0, 0.0, 0.0], box_inertia(1.0, [0.1, 0.1, 0.1]))
    scene = FreeBodies([cube])
    for _ in range(100):
        scene.x[:] = 0.0
        scene.q[0, :4], scene.q[0, 6] = random_quaternion(rng), 0.2
        states = scene.step(6000)
        assert np.abs(states[5000:, 7:]).max() < 1e-9
        assert 0.04999 < states[-1, 6] < 0.05  # on a face: half the edge above the ground


TABLE = Solid(("box", 1.0, 1.0, 0.1), p=(0.0, 0.0, -0.05))
BEAM = Solid(("box", 1.0, 0.02, 0.1), p=(0.0, 0.0, -0.05))
CAP = Solid(("cylinder", 0.3, 0.1), p=(0.0, 0.0, -0.05))
ON_EDGES = {
    "cylinder over an edge": lambda out: (TABLE, Solid(("cylinder", 0.1, 0.2), 1.0, p=(0.5 + out, 0.0, 0.1))),
    "disk over an edge": lambda out: (TABLE, Solid(("cylinder", 0.1, 0.02), 1.0, p=(0.5 + out, 0.0, 0.01))),
    "cylinder over a corner": lambda out: (TABLE, Solid(("cylinder", 0.1, 0.2), 1.0, p=(0.5 + out, 0.47, 0.1))),
    "disk on a beam": lambda out: (BEAM, Solid(("cylinder", 0.15, 0.02), 1.0, p=(0.0, 0.008 + 2.0 * out, 0.01))),
    "box on a cap": lambda out: (CAP, Solid(("box", 0.1, 0.1, 0.1), 1.0, p=(0.284 + 4.0 * out, 0.0, 0.05))),
    "cylinder on a cap": lambda out: (CAP, Solid(("cylinder", 0.1, 0.2), 1.0, p=(0.3 + 3.0 * out, 0.0, 0.1))),
}
"""What lies on what, with its centre of mass so far beyond (about) the edge of what bears it [m]."""


@pytest.mark.parametrize("approximation", ["lagged", "sap"])
@pytest.mark.parametrize("name", ON_EDGES)
def test_what_hangs_over_an_edge_stands_until_its_centre_of_mass_does_too(name, approximation):
    engine = DrakeLike("sheldrake", approximation)
    engine.start(Scene(list(ON_EDGES[name](-0.002))))
    start = engine.positions()[0]
    engine.advance(4.0)
    assert np.abs(engine.velocities()).max() < 1e-7
    assert np.abs(engine.positions()[0] - start).max() < 3e-4
    assert engine.rotations()[0][2, 2] > 1.0 - 1e-5
    engine.start(Scene(list(ON_EDGES[name](0.008))))
    engine.advance(2.0)
    assert engine.positions()[0][2] < -1.0


@pytest.mark.parametrize("turn", [0.0, 0.2, 0.39])
def test_a_cylinder_on_a_steep_table_tips_when_its_weight_is_beyond_the_rim(turn):
    """Whatever part of the rim is below: it stands as on a plane."""
    for part, stands in ((0.97, True), (1.03, False)):
        slope = np.arctan(0.5 * part)
        R = RotationMatrix.MakeYRotation(slope)
        rpy = tuple(RollPitchYaw(R @ RotationMatrix.MakeZRotation(turn)).vector())
        table = Solid(("box", 2.0, 2.0, 0.1), p=tuple(R @ [0.0, 0.0, -0.05]), rpy=(0.0, slope, 0.0))
        cylinder = Solid(("cylinder", 0.1, 0.4), 1.0, p=tuple(R @ [0.0, 0.0, 0.2]), rpy=rpy)
        engine = DrakeLike("sheldrake")
        engine.start(Scene([table, cylinder], friction=2.0))
        engine.advance(2.0)
        upright = R.matrix()[:, 2] @ engine.rotations()[0][:, 2]
        assert (upright > 1.0 - 1e-6) == stands
        assert not stands or np.abs(engine.velocities()[0, :3]).max() < 1e-8
