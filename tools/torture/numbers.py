"""Numbers that are none, or far off, where sound calls take a number: every public call with one argument exchanged.

A trial takes one call. Of `PHYSICAL` it knows what it makes: what is not refused is stepped, and then every position is
finite or an error says which is not. All other constructors and functions of the public list, and what sets, adds or
declares something on a robot, are first called with arguments that fit, found by chance, then with one of them
exchanged. Not a number is refused where it has a meaning; a call that passes numbers on as they are may take it.
"""

from __future__ import annotations

import contextlib
import functools
import inspect
import io
import math
import random
from collections.abc import Callable
from typing import Any

import numpy as np
from tools.torture.calls import _fine, _methods, _public, _short, _world

import sheldrake.all as lib

ODD = (
    math.nan,
    math.inf,
    -math.inf,
    -1.0,
    0.0,
    1e300,
    -1e300,
    5e-324,
    2**70,
    1j,
    None,
    "a",
    (),
    [[1.0], [1.0, 2.0]],
    np.zeros((2, 3, 4)),
    np.full(3, math.nan),
    object(),
)
ATTEMPTS = 60  # to find arguments that fit


class Scene:
    """A ball on the ground, two bodies on hinges with a motor, and what one number in it is."""

    def __init__(self, friction: Any = 0.5, damping: Any = 0.1, time_step: Any = 1e-3, properties: Any = None) -> None:
        self.builder = lib.DiagramBuilder()
        self.plant, _ = lib.AddMultibodyPlantSceneGraph(self.builder, time_step)
        plant, inertia = self.plant, lib.SpatialInertia.SolidSphereWithMass(1.0, 0.1)
        self.a, self.b, self.ball = (plant.AddRigidBody(name, inertia) for name in ("a", "b", "ball"))
        world = plant.world_frame()
        self.hinge = plant.AddJoint(lib.RevoluteJoint("j", world, self.a.body_frame(), [0, 1, 0], damping))
        self.slider = plant.AddJoint(lib.PrismaticJoint("s", world, self.b.body_frame(), [1, 0, 0], damping))
        self.motor = plant.AddJointActuator("m", self.hinge)
        properties = properties or lib.ProximityProperties()
        if not properties.HasProperty("material", "coulomb_friction"):
            lib.AddContactMaterial(None, None, lib.CoulombFriction(friction, friction), properties)
        pose = lib.RigidTransform([0.0, 0.0, -0.1])
        plant.RegisterCollisionGeometry(self.ball, lib.RigidTransform(), lib.Sphere(0.1), "ball", properties)
        plant.RegisterCollisionGeometry(plant.world_body(), pose, lib.HalfSpace(), "ground", properties)

    def step(self) -> None:
        """Some steps, after which all is finite."""
        plant = self.plant
        plant.Finalize()
        simulator = lib.Simulator(self.builder.Build())
        context = plant.GetMyMutableContextFromRoot(simulator.get_mutable_context())
        plant.get_actuation_input_port().FixValue(context, [1.0])
        plant.SetVelocities(context, np.full(plant.num_velocities(), 0.1))
        simulator.AdvanceTo(simulator.get_context().get_time() + 0.004)
        x = plant.GetPositionsAndVelocities(context)
        assert np.isfinite(x).all(), f"the state is {x}"

    def with_(self, call: Callable[[Scene], Any]) -> Scene:
        """This, after a call on it."""
        call(self)
        return self


def _set(call: Callable[[Scene, Any], Any]) -> Callable[[Any], Scene]:
    return lambda x: Scene().with_(lambda scene: call(scene, x))


def _properties(add: Callable[[Any, Any], Any]) -> Callable[[Any], Scene]:
    def make(x: Any) -> Scene:
        properties = lib.ProximityProperties()
        add(x, properties)
        return Scene(properties=properties)

    return make


def _force(make: Callable[[Scene, Any], Any]) -> Callable[[Any], Scene]:
    return _set(lambda scene, x: scene.plant.AddForceElement(make(scene, x)))


ORIGIN = np.zeros(3)
PHYSICAL: dict[str, Callable[[Any], Any]] = {
    "friction": lambda x: Scene(friction=x),
    "damping": lambda x: Scene(damping=x),
    "time step": lambda x: Scene(time_step=x),
    "set_default_damping": _set(lambda s, x: s.hinge.set_default_damping(x)),
    "effort limit": _set(lambda s, x: s.plant.AddJointActuator("n", s.slider, x)),
    "gear ratio": _set(lambda s, x: s.motor.set_default_gear_ratio(x)),
    "rotor inertia": _set(lambda s, x: s.motor.set_default_rotor_inertia(x)),
    "gain p": _set(lambda s, x: s.motor.set_controller_gains(lib.PdControllerGains(p=x, d=1.0))),
    "gain d": _set(lambda s, x: s.motor.set_controller_gains(lib.PdControllerGains(p=1.0, d=x))),
    "default angle": _set(lambda s, x: s.hinge.set_default_angle(x)),
    "position limit": _set(lambda s, x: s.hinge.set_position_limits([x], [1.0])),
    "gravity": _set(lambda s, x: s.plant.mutable_gravity_field().set_gravity_vector([0.0, 0.0, x])),
    "penetration allowance": _set(lambda s, x: s.plant.set_penetration_allowance(x)),
    "stiction tolerance": _set(lambda s, x: s.plant.set_stiction_tolerance(x)),
    "near rigid": _set(lambda s, x: s.plant.set_sap_near_rigid_threshold(x)),
    "distance": _set(lambda s, x: s.plant.AddDistanceConstraint(s.a, ORIGIN, s.b, ORIGIN + 1.0, x)),
    "distance stiffness": _set(lambda s, x: s.plant.AddDistanceConstraint(s.a, ORIGIN, s.b, ORIGIN + 1.0, 1.0, x)),
    "distance damping": _set(lambda s, x: s.plant.AddDistanceConstraint(s.a, ORIGIN, s.b, ORIGIN + 1.0, 1.0, 1.0, x)),
    "coupler": _set(lambda s, x: s.plant.AddCouplerConstraint(s.hinge, s.slider, x)),
    "coupler offset": _set(lambda s, x: s.plant.AddCouplerConstraint(s.hinge, s.slider, 1.0, x)),
    "dissipation": _properties(lambda x, p: lib.AddContactMaterial(x, None, None, p)),
    "stiffness": _properties(lambda x, p: lib.AddContactMaterial(None, x, None, p)),
    "modulus": _properties(lambda x, p: lib.AddCompliantHydroelasticProperties(0.05, x, p)),
    "resolution": _properties(lambda x, p: lib.AddCompliantHydroelasticProperties(x, 1e6, p)),
    "spring": _force(lambda s, x: lib.LinearSpringDamper(s.a, ORIGIN, s.b, ORIGIN + 1.0, 1.0, x, 1.0)),
    "spring length": _force(lambda s, x: lib.LinearSpringDamper(s.a, ORIGIN, s.b, ORIGIN + 1.0, x, 1.0, 1.0)),
    "spring damping": _force(lambda s, x: lib.LinearSpringDamper(s.a, ORIGIN, s.b, ORIGIN + 1.0, 1.0, 1.0, x)),
    "revolute spring": _force(lambda s, x: lib.RevoluteSpring(s.hinge, 0.1, x)),
    "revolute spring angle": _force(lambda s, x: lib.RevoluteSpring(s.hinge, x, 1.0)),
    "prismatic spring": _force(lambda s, x: lib.PrismaticSpring(s.slider, 0.1, x)),
    "sphere": lambda x: lib.Sphere(x),
    "box": lambda x: lib.Box(1.0, x, 1.0),
    "cylinder": lambda x: lib.Cylinder(1.0, x),
    "capsule": lambda x: lib.Capsule(x, 1.0),
    "ellipsoid": lambda x: lib.Ellipsoid(1.0, x, 1.0),
    "mesh scale": lambda x: lib.Mesh("a.obj", x),
    "mass": lambda x: lib.SpatialInertia(x, ORIGIN, lib.UnitInertia(1.0, 1.0, 1.0)),
    "publish period": lambda x: lib.LeafSystem().DeclarePeriodicPublishEvent(x, 0.0, print),
    "publish offset": lambda x: lib.LeafSystem().DeclarePeriodicPublishEvent(1.0, x, print),
    "hold": lambda x: lib.ZeroOrderHold(x, 1),
    "delay": lambda x: lib.DiscreteTimeDelay(x, 1, 1),
    "low pass": lambda x: lib.FirstOrderLowPassFilter(x, 1),
    "period": lambda x: lib.LinearSystem([[1]], [[1]], [[1]], [[1]], x),
    "realtime rate": lambda x: lib.Simulator(lib.Integrator(1)).set_target_realtime_rate(x),
    "accuracy": lambda x: lib.Simulator(lib.Integrator(1)).get_mutable_integrator().set_target_accuracy(x),
    "largest step": lambda x: lib.Simulator(lib.Integrator(1)).get_mutable_integrator().set_maximum_step_size(x),
    "clipping": lambda x: lib.ClippingRange(x, 10.0),
    "field of view": lambda x: lib.CameraInfo(10, 10, x),
    "sampling": lambda x: lib.RandomSource(lib.RandomDistribution.kUniform, 1, x),
    "breaks": lambda x: lib.PiecewisePolynomial.ZeroOrderHold([0.0, x], np.zeros((1, 2))),
}
TAKES_NAN = ("accuracy",)  # back to its default


def physical(number: int) -> None:
    """One of `PHYSICAL` with one odd number: an error in words, or what can be stepped."""
    name, make = list(PHYSICAL.items())[number % len(PHYSICAL)]
    x = ODD[number // len(PHYSICAL) % len(ODD)]
    try:
        with np.errstate(all="ignore"):
            made = make(x)
            assert name in TAKES_NAN or not _is_nan(x), f"{name} takes {x}"
            if isinstance(made, Scene):
                made.step()
    except AssertionError:
        raise
    except Exception as error:
        _fine(error, f"{name} of {_short(x)}")


def _is_nan(x: Any) -> bool:
    return bool(np.any(np.isnan(x))) if isinstance(x, (float, np.ndarray)) else False


# ---- all others


@functools.cache
def _robot() -> list[Any]:
    return _world()


def _pool(parameter: inspect.Parameter) -> list[Any]:
    """Values that a parameter may be made for, by its annotation."""
    words, world = str(parameter.annotation), _robot()
    by_class = [v for v in world if type(v).__name__ in words or any(b.__name__ in words for b in type(v).__mro__[:-1])]
    found: list[Any] = [*by_class]
    found += ["a"] if "str" in words else []
    found += [True] if "bool" in words else []
    found += [1, 2] if "int" in words else []
    found += [1.0] if "float" in words or "Scalar" in words else []
    if any(word in words for word in ("ArrayLike", "ndarray", "Sequence", "Scalar", "Iterable")):
        found += [np.ones(1), np.ones(2), np.ones(3), np.eye(2), np.eye(3)]
    return found or [1.0, np.ones(1), np.ones(2), np.ones(3), np.eye(1), np.eye(3), "a", 2, *world[:3], *world[6:10]]


def _that_fit(chance: random.Random, call: Callable[..., Any]) -> list[Any] | None:
    """Arguments that a call takes, one of them a number; None if chance finds none."""
    try:
        parameters = list(inspect.signature(call).parameters.values())
    except (TypeError, ValueError):
        return None
    placed = [p for p in parameters if p.kind in (p.POSITIONAL_ONLY, p.POSITIONAL_OR_KEYWORD)]
    more = [p for p in parameters if p.kind is p.VAR_POSITIONAL]
    least = sum(p.default is p.empty for p in placed)
    for _ in range(ATTEMPTS):
        chosen = placed[: chance.randint(least, len(placed))] + more * chance.randint(0, 4)
        arguments = [chance.choice(_pool(p)) for p in chosen]
        if any(isinstance(a, (float, np.ndarray)) for a in arguments):
            with contextlib.suppress(Exception):
                _quietly(call, arguments)
                return arguments
    return None


def _quietly(call: Callable[..., Any], arguments: list[Any]) -> Any:
    with contextlib.redirect_stdout(io.StringIO()), np.errstate(all="ignore"):
        return call(*arguments)


SERVES = ("Meldis",)  # opens a page
SETS = ("set_", "Set", "Add", "Register", "Fix", "Declare", "Make", "Calc", "Remove", "Eval")


@functools.cache
def _calls() -> list[tuple[str, Any]]:
    """All public classes and functions; what sets, adds, declares or computes something on an object of a robot."""
    found = [(name, call) for name, call in _public() if name not in SERVES]
    seen = set()
    for thing in _robot():
        names = [m for m in _methods(type(thing)) if m.startswith(SETS) and (type(thing), m) not in seen]
        seen |= {(type(thing), m) for m in names}
        found += [(f"{type(thing).__name__}.{m}", getattr(thing, m)) for m in names]
    return found


def odd_numbers(chance: random.Random, number: int) -> None:
    """One of the physical numbers, or every odd value in place of each argument of one public call."""
    if number % 2:
        return physical(number // 2)
    calls = _calls()
    name, call = calls[number // 2 % len(calls)]
    arguments = _that_fit(chance, call)
    for i, argument in enumerate(arguments or ()):
        if not isinstance(argument, (float, np.ndarray)):
            continue
        for x in ODD:
            bad: list[Any] = list(arguments or ())
            bad[i] = x
            if isinstance(argument, np.ndarray) and isinstance(x, float):
                bad[i] = argument.copy()
                bad[i].flat[chance.randrange(argument.size)] = x
            try:
                _quietly(call, bad)
            except Exception as error:
                _fine(error, f"{name}({', '.join(map(_short, bad))})")
    return None
