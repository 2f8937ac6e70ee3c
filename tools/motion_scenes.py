"""Scenes that between them run every compiled part of the library, each a function that gives its outcome as numbers.

`state_hashes.py` keeps and compares what they give. They are built from public names alone, and where there is one by
a benchmark or a test that has the scene already. Randomness is seeded; nothing depends on time or place.
"""

from __future__ import annotations

import contextlib
import functools
import itertools
from collections.abc import Callable
from typing import Any

import numpy as np
from benchmarks import arm, contact, gradients, hydroelastic, quadruped, queries, robots, signals
from benchmarks.engines import DrakeLike
from benchmarks.engines import Scene as Solids
from tests.scenes.scene import drop, library
from tests.unit.geometry.render_scenes import Studio, looking_from, seen
from tests.unit.systems.framework import saved_scenes

import sheldrake.all as lib
import sheldrake.examples as small
from sheldrake import model_path

BLOCK = "two_hole_block/two_hole_block"
OURS = "sheldrake"


def state_of(context: Any) -> np.ndarray:
    """Continuous and discrete state."""
    discrete = context.get_discrete_state()
    groups = [discrete.get_vector(k).CopyToVector() for k in range(discrete.num_groups())]
    return np.concatenate([context.get_continuous_state_vector().CopyToVector(), *groups])


def numbers_in(found: Any) -> np.ndarray:
    """What a query has answered, as one vector."""
    for name in ("GetAsMatrix34", "get_coeffs", "CopyToVector"):
        if hasattr(found, name):
            return np.ravel(getattr(found, name)())
    if isinstance(found, (list, tuple)):
        return np.concatenate([np.zeros(0), *map(numbers_in, found)])
    return np.zeros(0) if found is None else np.ravel(np.asarray(found, float))


class Workshop:
    """A plant under construction, then its motion.

    Args:
        time_step: [s]; 0 for continuous time.
        approximation: of `MultibodyPlantConfig`.
        algorithm: of contact points, "multi_point" or "single_point".
        config: more of `MultibodyPlantConfig`.
    """

    def __init__(
        self, time_step: float = 1e-3, approximation: str = "lagged", algorithm: str = "multi_point", **config: Any
    ):
        self.builder, self.algorithm = lib.DiagramBuilder(), algorithm
        config |= {"time_step": time_step, "discrete_contact_approximation": approximation}
        self.plant, _ = lib.AddMultibodyPlant(lib.MultibodyPlantConfig(**config), self.builder)
        self.rng = np.random.default_rng(7)
        self.free: list[tuple[Any, Any]] = []

    def body(self, name: str, mass: float = 1.0, size: float = 0.1) -> Any:
        """A body that is no symmetric top."""
        inertia = lib.SpatialInertia.SolidBoxWithMass(mass, size, 0.8 * size, 0.5 * size)
        return self.plant.AddRigidBody(name, inertia)

    def frame_on(self, body: Any) -> Any:
        """A frame somewhere on a body."""
        X_BF = lib.RigidTransform(lib.RollPitchYaw(self.rng.uniform(-0.5, 0.5, 3)), 0.2 * self.rng.normal(size=3))
        return self.plant.AddFrame(lib.FixedOffsetFrame(f"F{self.plant.num_frames()}", body.body_frame(), X_BF))

    def shape(self, body: Any, shape: Any, X_BG: Any = None, rigid: bool | None = None) -> None:
        """Gives a body a shape to touch with; with `rigid`, one that is rigid or compliant under pressure."""
        properties = lib.ProximityProperties()
        lib.AddContactMaterial(dissipation=5.0, friction=lib.CoulombFriction(0.6, 0.5), properties=properties)
        properties.AddProperty("material", "point_contact_algorithm", self.algorithm)
        if rigid:
            lib.AddRigidHydroelasticProperties(0.05, properties)
        elif rigid is not None and isinstance(shape, lib.HalfSpace):
            lib.AddCompliantHydroelasticPropertiesForHalfSpace(0.1, 1e6, properties)
        elif rigid is not None:
            lib.AddCompliantHydroelasticProperties(0.05, 1e6, properties)
        name = f"shape{self.plant.num_collision_geometries()}"
        self.plant.RegisterCollisionGeometry(body, X_BG or lib.RigidTransform(), shape, name, properties)

    def thing(self, shape: Any, p_WB: Any, rigid: bool | None = None) -> None:
        """A free body of a shape, turned somehow."""
        body = self.body(f"thing{len(self.free)}", 0.3)
        self.shape(body, shape, rigid=rigid)
        self.free.append((body, lib.RigidTransform(lib.RollPitchYaw(self.rng.uniform(-1.0, 1.0, 3)), p_WB)))

    def ready(self, scheme: str | None = None) -> Any:
        """A simulator, which an integrator by this name may drive."""
        self.plant.Finalize()
        simulator = lib.Simulator(self.builder.Build())
        self.context = self.plant.GetMyMutableContextFromRoot(simulator.get_mutable_context())
        for body, X_WB in self.free:
            self.plant.SetFreeBodyPose(self.context, body, X_WB)
        if scheme:
            lib.ResetIntegratorFromFlags(simulator, scheme, 0.02).set_target_accuracy(1e-4)
        return simulator

    def after(self, seconds: float, scheme: str | None = None) -> np.ndarray:
        """The state at some time."""
        simulator = self.ready(scheme)
        simulator.AdvanceTo(seconds)
        return state_of(simulator.get_context())


# ---- scenes of the benchmarks


def falling_block(**options: str) -> np.ndarray:
    """All states of the falling block."""
    simulator, sink, *_ = drop(library(OURS), str(model_path(f"{BLOCK}.urdf")), **options)
    simulator.AdvanceTo(1.0)
    return sink.FindLog(simulator.get_context()).data()


def many(solids: Solids, approximation: str, seconds: float) -> np.ndarray:
    """Many bodies."""
    engine = DrakeLike(OURS, approximation)
    engine.start(solids)
    engine.advance(seconds)
    return engine.plant.GetPositionsAndVelocities(engine.context)


def robot(make: Callable[[], Any]) -> np.ndarray:
    """A robot of a benchmark, after its turn of a second."""
    made = make()
    made.turn(1.0)
    return made.plant.GetPositionsAndVelocities(made.context)


def humanoid() -> np.ndarray:
    """A humanoid that falls freely, its limbs moving, in continuous time."""
    shop = Workshop(0.0)
    lib.Parser(shop.plant).AddModelsFromString(robots.humanoid_urdf(), "urdf")
    simulator = shop.ready("runge_kutta3")
    shop.plant.SetVelocities(shop.context, np.linspace(-1.0, 1.0, 35))
    simulator.AdvanceTo(0.2)
    return state_of(simulator.get_context())


def under_pressure(make: Callable[[Any], Any], seconds: float) -> np.ndarray:
    """Hydroelastic contact of a benchmark."""
    simulator = make(hydroelastic.library(OURS))
    simulator.AdvanceTo(seconds)
    return state_of(simulator.get_context())


def saved(name: str) -> np.ndarray:
    """Integrators in continuous time, and events of all kinds."""
    simulator = saved_scenes.simulator_of(*saved_scenes.SCENES[name]())
    simulator.AdvanceTo(0.8)
    return saved_scenes.outcome(simulator.get_context())


# ---- mechanisms

RAIL = [0.0, 0.5, 0.9, 2.0], [2.0, 0.0, -0.7], [0.0, 3.0, 3.0], [2.0, 0.0, 0.0], [0.1, 0.2, 0.3]
JOINTS: dict[str, Callable[..., Any]] = {
    "revolute": lambda *ends: lib.RevoluteJoint(*ends, [0.6, 0.0, 0.8], -0.3, 0.4, 0.1),
    "prismatic": lambda *ends: lib.PrismaticJoint(*ends, [0.0, 0.6, 0.8], -0.1, 0.1, 0.2),
    "screw": lambda *ends: lib.ScrewJoint(*ends, [0.0, 0.0, 1.0], 0.4, 0.1),
    "planar": lambda *ends: lib.PlanarJoint(*ends, [0.1, 0.2, 0.3]),
    "universal": lambda *ends: lib.UniversalJoint(*ends, 0.1),
    "ball": lambda *ends: lib.BallRpyJoint(*ends, 0.1),
    "rpy": lambda *ends: lib.RpyFloatingJoint(*ends, 0.1, 0.2),
    "quaternion": lambda *ends: lib.QuaternionFloatingJoint(*ends, 0.1, 0.2),
    "weld": lambda *ends: lib.WeldJoint(*ends, lib.RigidTransform(lib.RollPitchYaw(0.1, 0.2, 0.3), [0.1, 0.0, 0.2])),
    "curvilinear": lambda *ends: lib.CurvilinearJoint(*ends, lib.PiecewiseConstantCurvatureTrajectory(*RAIL), 0.1),
}


def all_joints(
    time_step: float, scheme: str | None = None, locked: tuple[str, ...] = (), approximation: str = "lagged"
) -> np.ndarray:
    """Two bodies a kind of joint, one behind the other, with springs, a bushing and the friction of a hinge."""
    shop = Workshop(time_step, approximation)
    plant = shop.plant
    made, ends = {}, []
    for kind, joint in JOINTS.items():
        parent = plant.world_body()
        for k in range(2):
            child = shop.body(f"{kind}{k}", 1.0 + k, 0.3)
            made[f"{kind}{k}"] = plant.AddJoint(joint(f"{kind}{k}", shop.frame_on(parent), shop.frame_on(child)))
            parent = child
        ends.append(parent)
    plant.AddForceElement(lib.RevoluteSpring(made["revolute0"], 0.3, 4.0))
    plant.AddForceElement(lib.PrismaticSpring(made["prismatic1"], 0.1, 50.0))
    plant.AddForceElement(lib.LinearSpringDamper(ends[0], [0.1, 0, 0], ends[5], [0, 0, 0.1], 0.3, 20.0, 2.0))
    hands = [shop.frame_on(end) for end in (ends[2], ends[6])]
    plant.AddForceElement(lib.LinearBushingRollPitchYaw(*hands, *([k, k, k] for k in (2.0, 0.2, 5.0, 0.5))))
    plant.AddForceElement(lib.DoorHinge(made["revolute1"], lib.DoorHingeConfig(motion_threshold=0.1)))
    simulator = shop.ready(scheme)
    plant.SetVelocities(shop.context, np.random.default_rng(5).uniform(-0.5, 0.5, plant.num_velocities()))
    for name in locked:
        made[name].Lock(shop.context)
    simulator.AdvanceTo(0.3)
    for name in locked:
        made[name].Unlock(shop.context)
    simulator.AdvanceTo(0.5)
    return state_of(simulator.get_context())


def constrained(approximation: str, *kinds: str) -> np.ndarray:
    """An arm at its limits with motors and gains, a slider, free bodies; constraints between them; the ground."""
    shop = Workshop(approximation=approximation)
    plant = shop.plant
    parent, joints, links = plant.world_body(), [], []
    for k, axis in enumerate(([0, 1, 0], [1, 0, 0], [0, 0.6, 0.8])):
        link = shop.body(f"link{k}", 1.0 + k, 0.3)
        F = plant.AddFrame(lib.FixedOffsetFrame(f"end{k}", parent.body_frame(), lib.RigidTransform([0, 0.02, -0.3])))
        joints.append(plant.AddJoint(lib.RevoluteJoint(f"j{k}", F, link.body_frame(), axis, -0.2, 0.3, 0.1)))
        motor = plant.AddJointActuator(f"m{k}", joints[-1], (20.0, np.inf, 2.0)[k])
        if k < 2:
            motor.set_controller_gains(lib.PdControllerGains(p=100.0 * (k + 1), d=10.0))
        links.append(link)
        parent = link
    slider = shop.body("slider", 0.7, 0.2)
    slide = plant.AddJoint(lib.PrismaticJoint("slide", plant.world_frame(), slider.body_frame(), [1, 0, 0], -0.1, 0.1))
    A, B, C = (shop.body(name, 0.5, 0.2) for name in "ABC")
    for k, body in enumerate((A, B, C)):
        shop.shape(body, lib.Box(0.2, 0.16, 0.1))
        shop.free.append((body, lib.RigidTransform([0.3 + 0.25 * k, 0.0, -1.0 + 0.02 * k])))
    shop.shape(plant.world_body(), lib.HalfSpace(), lib.RigidTransform([0, 0, -1.1]))
    X_BP = lib.RigidTransform(lib.RollPitchYaw(0.1, 0.0, 0.0), [0.12, 0.0, 0.0])
    add = {
        "coupler": lambda: plant.AddCouplerConstraint(joints[1], slide, 1.7, 0.05),
        "distance": lambda: plant.AddDistanceConstraint(links[2], [0, 0, -0.3], A, [0.1, 0.05, 0], 0.25),
        "spring": lambda: plant.AddDistanceConstraint(links[2], [0, 0, -0.3], B, [0.1, 0, 0], 0.25, 200.0, 3.0),
        "ball": lambda: plant.AddBallConstraint(A, [0.12, 0.0, 0.0], B, [-0.12, 0.0, 0.0]),
        "weld": lambda: plant.AddWeldConstraint(B, X_BP, C, lib.RigidTransform([-0.12, 0, 0])),
        "tendon": lambda: plant.AddTendonConstraint([joints[0], slide], [1.0, 2.0], 0.05, -0.1, 0.1, 1e4, 5.0),
    }
    for kind in kinds:
        add[kind]()
    simulator = shop.ready()
    plant.get_actuation_input_port().FixValue(shop.context, [0.5, -1.0, 5.0])
    desired = plant.get_desired_state_input_port(lib.default_model_instance())
    desired.FixValue(shop.context, [0.2, -0.1, 0.0, 0.5, 0.0, 0.0])
    simulator.AdvanceTo(1.0)
    return state_of(simulator.get_context())


def dry_friction(approximation: str) -> np.ndarray:
    """A pendulum, and what slides down and up a slope, until friction stops them."""
    shop = Workshop(approximation=approximation)
    W = shop.plant.world_frame()
    ends = [shop.body(f"b{k}", 2.0, 0.2).body_frame() for k in range(2)]
    M = shop.plant.AddFrame(lib.FixedOffsetFrame("top", ends[0], lib.RigidTransform([0.0, 0.0, 0.5])))
    joints = lib.RevoluteJoint("swing", W, M, [0, 1, 0]), lib.PrismaticJoint("slide", W, ends[1], [0.96, 0.0, -0.28])
    for joint, effort in zip(joints, (0.5, 6.0)):
        shop.plant.AddJoint(joint).set_dry_friction(effort)
    simulator = shop.ready()
    shop.plant.SetPositionsAndVelocities(shop.context, [1.0, 0.0, 0.5, -1.5])
    simulator.AdvanceTo(1.0)
    return state_of(simulator.get_context())


# ---- shapes


def shapes() -> dict[str, Any]:
    """One of each kind that may move, about 10 cm large."""
    corners = np.array(list(itertools.product((-0.04, 0.05), (-0.03, 0.04), (-0.05, 0.03))))
    corners = np.concatenate([corners, [[0.08, 0.0, 0.0], [0.0, 0.01, 0.07]]])
    return {
        "sphere": lib.Sphere(0.05),
        "box": lib.Box(0.1, 0.08, 0.06),
        "cylinder": lib.Cylinder(0.04, 0.1),
        "capsule": lib.Capsule(0.03, 0.08),
        "ellipsoid": lib.Ellipsoid(0.06, 0.05, 0.04),
        "convex": lib.Convex(corners.T, "stone"),
    }


def all_pairs(approximation: str, algorithm: str = "multi_point") -> Workshop:
    """Each kind of shape above each, whose body is fixed, and above the ground."""
    shop = Workshop(approximation=approximation, algorithm=algorithm)
    world = shop.plant.world_body()
    shop.shape(world, lib.HalfSpace())
    for n, (upper, lower) in enumerate(itertools.combinations_with_replacement(shapes().values(), 2)):
        x, y = 0.5 * (n % 5), 0.5 * (n // 5)
        shop.shape(world, lower, lib.RigidTransform(lib.RollPitchYaw(0.1, 0.2, 0.3), [x, y, 0.05]))
        shop.thing(upper, [x + 0.01, y - 0.005, 0.17])
    for n, shape in enumerate(shapes().values()):
        shop.thing(shape, [0.5 * n, -0.5, 0.12])
    return shop


def heap(approximation: str, count: int = 24) -> Workshop:
    """A bin full of shapes of all kinds."""
    shop = Workshop(approximation=approximation)
    for wall in contact.walls(0.2):
        X_WG = lib.RigidTransform(lib.RollPitchYaw(*wall.rpy), wall.p)
        shop.shape(shop.plant.world_body(), lib.HalfSpace(), X_WG)
    for n, shape in zip(range(count), itertools.cycle(shapes().values())):
        shop.thing(shape, [0.12 * (n % 3 - 1), 0.12 * (n // 3 % 3 - 1), 0.1 + 0.13 * (n // 9)])
    return shop


def pressed(compliant_ground: bool, scheme: str | None = None, **options: Any) -> np.ndarray:
    """Shapes of all kinds under pressure, on a ground and on a table; points where pressure is not to be had."""
    shop = Workshop(**options)
    world = shop.plant.world_body()
    shop.shape(world, lib.HalfSpace(), rigid=not compliant_ground)
    shop.shape(world, lib.Box(2.0, 0.3, 0.1), lib.RigidTransform([0.5, 0.5, 0.05]), rigid=not compliant_ground)
    for n, shape in enumerate(shapes().values()):
        for y, height in ((0.0, 0.0), (0.5, 0.1)):
            shop.thing(shape, [0.2 * n, y, height + 0.07], rigid=compliant_ground and n % 2 == 0)
    return shop.after(0.1 if scheme else 0.2, scheme)


def pressed_alone() -> np.ndarray:
    """A box, a ball and a mesh with holes on a ground, where touching in points is not allowed."""
    shop = Workshop(contact_model="hydroelastic")
    shop.shape(shop.plant.world_body(), lib.HalfSpace(), rigid=True)
    block = lib.Mesh(str(model_path(f"{BLOCK}.obj")), 0.001)
    for x, shape in enumerate((lib.Box(0.1, 0.08, 0.06), lib.Sphere(0.05), block)):
        shop.thing(shape, [x, 0.0, 0.08], rigid=False)
    return shop.after(0.3)


def by_cenic() -> np.ndarray:
    """Some shapes fall on the ground in steps of controlled error."""
    shop = Workshop(0.0)
    shop.shape(shop.plant.world_body(), lib.HalfSpace())
    for n, shape in enumerate(shapes().values()):
        shop.thing(shape, [0.09 * n, 0.0, 0.1])
    return shop.after(0.3, "cenic")


# ---- signals


def logged(diagram: Any, seconds: float) -> np.ndarray:
    """All that the logs of a diagram hold, and its state."""
    simulator = lib.Simulator(diagram)
    simulator.AdvanceTo(seconds)
    context = simulator.get_context()
    logs = [s.FindLog(context) for s in diagram.GetSystems() if isinstance(s, lib.VectorLogSink)]
    return np.concatenate([numbers_in([log.sample_times(), log.data()]) for log in logs] + [state_of(context)])


def many_rates() -> np.ndarray:
    """A chain of blocks of several rates and of continuous time, a controller beside it; logs of several rates."""
    builder = lib.DiagramBuilder()
    wave = builder.AddSystem(lib.Sine([1.0, 0.5], [3.0, 7.0], [0.1, 0.4]))
    A, B = np.array([[0.9, 0.1], [-0.2, 0.8]]), np.array([[0.0, 0.1], [0.2, 0.0]])
    chain = [
        lib.ZeroOrderHold(0.005, 2),
        lib.LinearSystem(A, B, np.eye(2), 0.1 * B, 0.01),
        lib.DiscreteTimeDelay(0.02, 3, 2),
        lib.FirstOrderLowPassFilter(0.2, 2),
        lib.LinearSystem(A - 2.0 * np.eye(2), B, np.eye(2), B),
        lib.Gain([2.0, -0.5]),
        lib.Saturation([-0.15, -0.02], [0.1, 0.05]),
        lib.Integrator(2),
        lib.WrapToSystem(2),
        lib.DiscreteDerivative(2, 0.004),
    ]
    chain[8].set_interval(0, -0.01, 0.01)
    before = wave.get_output_port(0)
    for block in map(builder.AddSystem, chain):
        builder.Connect(before, block.get_input_port())
        before = block.get_output_port()
    difference, pid = builder.AddSystem(lib.Adder(2, 2)), builder.AddSystem(lib.PidController([2.0], [0.5], [0.1]))
    builder.Connect(chain[7].get_output_port(), difference.get_input_port(0))
    builder.Connect(chain[3].get_output_port(), difference.get_input_port(1))
    builder.Connect(difference.get_output_port(), pid.get_input_port_estimated_state())
    builder.Connect(wave.get_output_port(0), pid.get_input_port_desired_state())
    for port, period in ((before, 0.0), (pid.get_output_port(), 0.003), (difference.get_output_port(), 0.05)):
        lib.LogVectorOutput(port, builder, period)
    return logged(builder.Build(), 1.0)


def routes() -> np.ndarray:
    """Signals that are joined, picked, parted and counted; systems without input or feedthrough."""
    builder = lib.DiagramBuilder()
    A, B = np.array([[-0.1, 2.0], [-2.0, -0.2]]), np.array([[0.0], [1.0]])
    free = {"B": np.zeros((2, 0)), "C": np.eye(2), "D": np.zeros((2, 0))}
    sources = [
        lib.LinearSystem(A=A, **free),
        lib.LinearSystem(A=np.eye(2) + 0.01 * A, **free, time_period=0.01),
        lib.AffineSystem(A, B, [0.1, 0.2], np.eye(2), np.zeros((2, 1)), [0.3, 0.4]),
    ]
    Pick = lib.SelectorParams.OutputSelection
    picks = [Pick(input_port_index=0, input_offset=k) for k in (5, 0, 3)]
    params = lib.SelectorParams(
        inputs=[lib.SelectorParams.InputPortParams(size=6)],
        outputs=[lib.SelectorParams.OutputPortParams(selections=picks)],
    )
    chain = [
        lib.Multiplexer([2, 2, 2]),
        lib.Selector(params),
        lib.Sine(1.0, 3.0, 0.2, 3, False),
        lib.DiscreteTimeIntegrator(3, 0.002),
        lib.RotaryEncoders(3, [2, 0], [4096, 8192]),
        lib.Demultiplexer(2),
    ]
    for system in (*sources, *chain):
        builder.AddSystem(system)
    for k, source in enumerate(sources):
        builder.Connect(source.get_output_port(), chain[0].get_input_port(k))
    for before, block in itertools.pairwise(chain):
        builder.Connect(before.get_output_port(0), block.get_input_port(0))
    builder.Connect(chain[-1].get_output_port(0), sources[2].get_input_port())
    for port in (chain[2].get_output_port(0), chain[-1].get_output_port(1)):
        lib.LogVectorOutput(port, builder, 0.01)
    diagram = builder.Build()
    for source, x in zip(sources, ([1.0, 0.5], [0.5, -1.0], [0.2, 0.3])):
        source.configure_default_state(x)
    return logged(diagram, 1.0)


def small_plants() -> np.ndarray:
    """The plants of textbooks; the compass gait's feet are witnessed."""
    starts = {
        small.PendulumPlant: [1.0, 0.2],
        small.AcrobotPlant: [1.0, 0.5, 0.0, 0.3],
        small.VanDerPolOscillator: [0.5, 1.0],
        small.QuadrotorPlant: np.linspace(0.1, 0.5, 12),
        small.CompassGait: [0.0, 0.0, 0.4, -2.0],
        small.RimlessWheel: [0.0, 4.0],
    }
    found = []
    for make, x in starts.items():
        plant = make()
        simulator = lib.Simulator(plant)
        context = simulator.get_mutable_context()
        for k in range(plant.num_input_ports()):
            port = plant.get_input_port(k)
            port.FixValue(context, np.full(port.size(), 0.3))
        context.SetContinuousState(x)
        simulator.AdvanceTo(1.0)
        found.append(state_of(simulator.get_context()))
    return np.concatenate(found)


# ---- queries


def pictures() -> np.ndarray:
    """Depth, labels and colours of shapes of all kinds and a mesh on the ground."""
    things = [seen(lib.HalfSpace(), label=1, color=(0.5, 0.6, 0.5, 1.0))]
    everything = [*shapes().values(), lib.Mesh(str(model_path(f"{BLOCK}.obj")), 0.001)]
    for n, shape in enumerate(everything):
        X_WG = lib.RigidTransform(lib.RollPitchYaw(0.1 * n, 0.3, 0.5), [0.15 * (n % 3), 0.15 * (n // 3), 0.06])
        things.append(seen(shape, X_WG, (0.1 * n, 0.5, 1.0 - 0.1 * n, 1.0), 2 + n))
    studio, eye = Studio(*things), looking_from([0.8, -0.6, 0.5], [0.15, 0.15, 0.05])
    return numbers_in([studio.depths(eye), studio.labels(eye), studio.colors(eye)])


def distances() -> np.ndarray:
    """Distances, penetrations and rays in a bin of shapes of all kinds."""
    shop = heap("lagged")
    simulator = shop.ready()
    simulator.AdvanceTo(0.3)
    query = shop.plant.get_geometry_query_input_port().Eval(shop.context)
    pairs = query.ComputeSignedDistancePairwiseClosestPoints(0.2)
    points = query.ComputeSignedDistanceToPoint([0.01, 0.02, 0.15])
    deep = query.ComputePointPairPenetration()
    return numbers_in(
        [
            [(p.distance, p.p_ACa, p.p_BCb, p.nhat_BA_W) for p in pairs],
            [(p.distance, p.p_GN, p.grad_W) for p in points],
            [(p.depth, p.p_WCa, p.p_WCb, p.nhat_BA_W) for p in deep],
            float(query.HasCollisions()),
            float(len(query.FindCollisionCandidates())),
        ]
    )


def questions_to_an_arm() -> np.ndarray:
    """What is asked of an arm at some positions."""
    calls = queries.drake_like(OURS)
    asked = np.random.default_rng(2).uniform(-1.0, 1.0, (5, 7))
    return numbers_in([call(q) for call in calls.values() for q in asked])


def questions_to_a_humanoid() -> np.ndarray:
    """What is asked of a floating humanoid: energies, momenta, accelerations, Jacobians, forces."""
    plant = lib.MultibodyPlant(0.0)
    lib.Parser(plant).AddModelsFromString(robots.humanoid_urdf(), "urdf")
    plant.Finalize()
    context, W = plant.CreateDefaultContext(), plant.world_frame()
    foot = plant.GetFrameByName("right_leg6")
    hand, wrt = plant.GetBodyByName("left_arm7"), lib.JacobianWrtVariable.kV
    v = np.linspace(-1.0, 1.0, 35)
    plant.SetPositionsAndVelocities(context, [1.0, 0.0, 0.0, 0.0, *np.linspace(-0.5, 0.5, 32), *v])
    ends = hand.body_frame(), [0.1, 0.2, 0.3], W, W
    forces = lib.MultibodyForces(plant)
    plant.CalcForceElementsContribution(context, forces)
    return numbers_in(
        [
            plant.CalcMassMatrix(context),
            plant.CalcBiasTerm(context),
            plant.EvalTimeDerivatives(context),
            plant.MapVelocityToQDot(context, v),
            plant.MapQDotToVelocity(context, np.linspace(1.0, -1.0, 36)),
            plant.CalcGeneralizedForces(context, forces),
            plant.CalcKineticEnergy(context),
            plant.CalcPotentialEnergy(context),
            plant.CalcSpatialMomentumInWorldAboutPoint(context, [0.0, 0.0, 0.0]),
            plant.CalcCenterOfMassPositionInWorld(context),
            plant.CalcCenterOfMassTranslationalVelocityInWorld(context),
            plant.CalcJacobianCenterOfMassTranslationalVelocity(context, wrt, foot, W),
            plant.CalcJacobianSpatialVelocity(context, wrt, *ends),
            plant.CalcJacobianPositionVector(context, hand.body_frame(), [0.1, 0.2, 0.3], foot, foot),
            plant.CalcBiasSpatialAcceleration(context, wrt, *ends),
            plant.EvalBodySpatialAccelerationInWorld(context, hand),
            plant.CalcRelativeTransform(context, foot, hand.body_frame()),
        ]
    )


# ---- derivatives


def at_once() -> None:
    """Has machine code on complex numbers made at the first derivative, where it would be at a later one."""
    with contextlib.suppress(ImportError, AttributeError):
        from sheldrake.autodiffutils import _complex_step

        _complex_step.PATIENCE = 0


def derivatives_of_an_arm(make: Callable[[Any], Callable[[np.ndarray], Any]]) -> np.ndarray:
    """Derivatives by state and inputs."""
    at_once()
    gradient = make(lib)
    return numbers_in([gradient(z) for z in np.random.default_rng(1).uniform(-1.0, 1.0, (3, 21))])


def derivatives_in_contact(approximation: str, shape: Any = None, ground: Any = None) -> np.ndarray:
    """Derivatives of a step of a ball that slides on the ground, or of another shape 10 cm high on another ground."""
    at_once()
    shop = Workshop(approximation=approximation, use_sampled_output_ports=False)
    ball = shop.body("ball")
    shop.shape(ball, shape or lib.Sphere(0.1))
    X_WG = lib.RigidTransform([0.0, 0.0, -0.1]) if ground else None
    shop.shape(shop.plant.world_body(), ground or lib.HalfSpace(), X_WG)
    shop.plant.Finalize()
    diagram = shop.builder.Build().ToAutoDiffXd()
    context = diagram.CreateDefaultContext()
    found = []
    for z, wxyz in ((0.0995, [0.9998, -0.016, 0.012, 0.0]), (0.099, [0.9998, 0.012, -0.016, 0.0])):
        x = [*wxyz, 0.0, 0.0, z, 0.1, 0.2, 0.3, 0.5, 0.1, -0.2]
        context.SetDiscreteState(lib.InitializeAutoDiff(x).ravel())
        after = diagram.EvalUniquePeriodicDiscreteUpdate(context).get_vector(0).CopyToVector()
        found.append(lib.ExtractGradient(after))
    return numbers_in(found)


# ---- all of them

EVERY_CONSTRAINT = "coupler", "spring", "ball", "weld", "tendon"
p = functools.partial
SCENES: dict[str, Callable[[], np.ndarray]] = {
    **{
        f"drop {a} {b}": p(falling_block, approximation=a, algorithm=b)
        for a in ("kLagged", "kSimilar", "kSap", "kTamsi")
        for b in ("multi_point", "single_point")
    },
    "drop default": falling_block,
    **{
        f"{name} {a}": p(many, contact.scene(name), a, 0.5 if name == "pile" else 1.0)
        for a in ("lagged", "sap", "tamsi")
        for name in ("stack", "clutter20", "pile")
    },
    "clutter200 lagged": p(many, contact.scene("clutter200"), "lagged", 0.2),
    "islands lagged": p(many, contact.pairs(64), "lagged", 0.1),
    "arm motors": p(robot, p(arm.DrakeLike, OURS, True)),
    "arm PID": p(robot, p(arm.DrakeLike, OURS, False)),
    "quadruped": p(robot, p(quadruped.DrakeLike, OURS, 0.0)),
    "humanoid": humanoid,
    "hydroelastic ball": p(under_pressure, hydroelastic.ball_on_ground, 0.4),
    "hydroelastic box": p(under_pressure, hydroelastic.box_on_table, 0.4),
    "hydroelastic balls": p(under_pressure, hydroelastic.two_fine_balls, 0.4),
    "hydroelastic bin": p(under_pressure, hydroelastic.bin_of_bodies, 0.1),
    "hydroelastic shapes lagged": p(pressed, False),
    "hydroelastic shapes sap": p(pressed, True, approximation="sap"),
    "hydroelastic shapes tamsi": p(pressed, True, approximation="tamsi"),
    "hydroelastic shapes runge_kutta3": p(pressed, False, "runge_kutta3", time_step=0.0),
    "hydroelastic alone": pressed_alone,
    **{f"saved {name}": p(saved, name) for name in saved_scenes.SCENES},
    "cenic shapes": by_cenic,
    "joints": p(all_joints, 1e-3),
    "joints locked": p(all_joints, 1e-3, None, ("revolute0", "planar1", "ball0", "quaternion1", "curvilinear0")),
    "joints tamsi": p(all_joints, 1e-3, approximation="tamsi"),
    "joints runge_kutta3": p(all_joints, 0.0, "runge_kutta3"),
    "constraints lagged": p(constrained, "lagged", *EVERY_CONSTRAINT),
    "constraints sap": p(constrained, "sap", *EVERY_CONSTRAINT),
    "constraint distance": p(constrained, "similar", "distance"),
    "limits tamsi": p(constrained, "tamsi"),
    "dry friction": p(dry_friction, "sap"),
    "shape pairs lagged": lambda: all_pairs("lagged").after(0.4),
    "shape pairs sap single_point": lambda: all_pairs("sap", "single_point").after(0.4),
    "heap lagged": lambda: heap("lagged").after(0.6),
    "heap tamsi": lambda: heap("tamsi").after(0.6),
    "heap of many": lambda: heap("lagged", 120).after(0.15),
    "signals": lambda: logged(signals.chains(lib), 0.5),
    "signals many rates": many_rates,
    "signals routes": routes,
    "signals python": lambda: logged(signals.controlled(lib, True), 0.5),
    "small plants": small_plants,
    "pictures": pictures,
    "distances": distances,
    "questions arm": questions_to_an_arm,
    "questions humanoid": questions_to_a_humanoid,
    "gradient derivatives": p(derivatives_of_an_arm, p(gradients.motion, time_step=0.0)),
    "gradient step": p(derivatives_of_an_arm, p(gradients.motion, time_step=1e-3)),
    "gradient linearize": p(derivatives_of_an_arm, gradients.linear_model),
    "gradient contact lagged": p(derivatives_in_contact, "lagged"),
    "gradient contact sap": p(derivatives_in_contact, "sap"),
    "gradient contact boxes": p(derivatives_in_contact, "similar", lib.Box(0.2, 0.2, 0.2), lib.Box(0.4, 0.3, 0.2)),
    "gradient contact capsule": p(derivatives_in_contact, "tamsi", lib.Capsule(0.1, 0.1), lib.Box(0.4, 0.3, 0.2)),
}
