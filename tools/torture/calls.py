"""Public calls with arguments that nobody means: of another type, shape or size, not finite, of another diagram.

A trial has a small world of live objects and makes some calls on it. A call returns or raises an exception with a text;
it never takes the process with it, nor what others compute: afterwards a scene that has nothing to do with that world
still gives the same bits.
"""

from __future__ import annotations

import contextlib
import functools
import inspect
import io
import os
import random
import tempfile
from collections.abc import Callable
from typing import Any

import numpy as np

import sheldrake.all as everything
from sheldrake.geometry import Box, GeometryFrame, GeometryInstance, SceneGraph, Sphere
from sheldrake.math import RigidTransform, RotationMatrix
from sheldrake.multibody.parsing import Parser
from sheldrake.multibody.plant import AddMultibodyPlantSceneGraph
from sheldrake.systems.analysis import Simulator
from sheldrake.systems.framework import DiagramBuilder
from sheldrake.systems.primitives import ConstantVectorSource, Integrator, LogVectorOutput

CALLS = 20  # of one trial
MODEL = """<robot name="r"><link name="a"><inertial><mass value="1"/><inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0"
iyz="0"/></inertial><collision><geometry><box size="1 1 1"/></geometry></collision></link><link name="b"><inertial>
<mass value="1"/><inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial><collision><geometry>
<sphere radius="1"/></geometry></collision></link><joint name="j" type="revolute"><parent link="a"/><child link="b"/>
<axis xyz="0 0 1"/><limit lower="-1" upper="1" effort="1" velocity="1"/></joint><transmission>
<type>transmission_interface/SimpleTransmission</type>
<joint name="j"><hardwareInterface>EffortJointInterface</hardwareInterface></joint>
<actuator name="m"/></transmission></robot>"""
WAITS = ("Meshcat", "Lcm", "LCM", "Render", "render", "Server", "Visualiz", "Sleep",
         "Realtime", "realtime", "Slider",
         "Monte",
         "Batch", "Teleop", "WebSocket", "Start", "trigger", "Show", "Plot", "Download", "Remote",
         "Foreign")  # fmt: skip
"""In names of what opens windows or sockets, starts processes, or waits for a person or a clock."""
LONG = ("AdvanceTo", "IntegrateWithMultipleStepsToTime", "IntegrateNoFurtherThanTime", "IntegrateWithSingleFixedStep")
"""What takes as long as it is asked to."""


def _raises(*_: Any, **__: Any) -> Any:
    raise RuntimeError("from a callback")


def _values(chance: random.Random) -> list[Callable[[], Any]]:
    """Makes values that are somebody's, but hardly what is asked for."""
    n = chance.choice((0, 1, 2, 3, 4, 6, 7, 13, 100))
    x = chance.choice((0.0, -0.0, 1.0, -1.0, 0.5, 1e300, -1e300, 5e-324, np.inf, -np.inf, np.nan))
    return [
        lambda: None,
        lambda: x,
        lambda: x,
        lambda: chance.choice((0, 1, -1, 2, 7, 1000, 2**31, -(2**63), 2**63, 2**70)),
        lambda: chance.choice(("", "a", "b", "j", "r", "x" * 1000, "\x00", "\ud800", "é", "::", "../x", "%s{}")),
        lambda: chance.choice((True, False, ..., NotImplemented, b"", object(), 1j, int, _raises, lambda: None)),
        lambda: np.full(n, x),
        lambda: np.full((3, n), x),
        lambda: np.full((n, n), x),
        lambda: np.full((n, 1), x)[::-1],
        lambda: np.zeros((n, 3, 1), np.float32),
        lambda: np.zeros(n, chance.choice((np.int8, np.uint64, bool, complex, object, "U3", ">f8"))),
        lambda: np.broadcast_to(x, (n,)),
        lambda: [x] * n,
        lambda: chance.choice(([], (), {}, {"a": x}, [[1.0], [1.0, 2.0]], ["a"], [None], {1, 2}, range(n))),
        lambda: iter([x] * n),
    ]


def _world() -> list[Any]:
    """A robot with geometry in a diagram, and parts of it."""
    builder = DiagramBuilder()
    plant, scene_graph = AddMultibodyPlantSceneGraph(builder, 1e-3)
    Parser(plant).AddModelsFromString(MODEL, "urdf")
    plant.Finalize()
    source, sum_ = builder.AddSystem(ConstantVectorSource([0.1])), builder.AddSystem(Integrator(1))
    builder.Connect(source.get_output_port(), plant.get_actuation_input_port())
    builder.Connect(source.get_output_port(), sum_.get_input_port())
    log = LogVectorOutput(plant.get_state_output_port(), builder)
    diagram = builder.Build()
    simulator = Simulator(diagram)
    simulator.AdvanceTo(0.002)
    context = simulator.get_mutable_context()
    mine = plant.GetMyMutableContextFromRoot(context)
    query = scene_graph.get_query_output_port().Eval(scene_graph.GetMyContextFromRoot(context))
    of_plant = [plant.GetBodyByName("a"), plant.GetBodyByName("b"), plant.GetJointByName("j"), plant.world_frame()]
    others = [DiagramBuilder(), SceneGraph(), everything.MultibodyPlant(1e-3), everything.MathematicalProgram()]
    values = [RigidTransform(), RotationMatrix(), Box(1, 1, 1), Sphere(1.0), GeometryFrame("f")]
    values.append(GeometryInstance(RigidTransform(), Sphere(1.0), "g"))
    values.append(everything.PiecewisePolynomial.FirstOrderHold([0.0, 1.0], np.zeros((2, 2))))
    values.append(everything.SpatialInertia.SolidCubeWithDensity(1.0, 1.0))
    values += [everything.Variable("x"), everything.AutoDiffXd(1.0, [1.0]), everything.HPolyhedron.MakeUnitBox(2)]
    framework = [context, mine, context.Clone(), log.FindLog(context), plant.get_state_output_port()]
    framework += [plant.get_actuation_input_port(), simulator.get_mutable_integrator(), query, query.inspector()]
    return [plant, plant, diagram, simulator, scene_graph, sum_, *of_plant, *others, *values, *framework]


@functools.cache
def _public() -> list[tuple[str, Any]]:
    """Classes and functions of the public list."""
    found = [(name, getattr(everything, name)) for name in dir(everything) if name[0] != "_"]
    return [(name, call) for name, call in found if callable(call) and not any(w in name for w in WAITS)]


@functools.cache
def _methods(cls: type) -> list[str]:
    return [m for m in dir(cls) if (m[0] != "_" or m in DUNDERS) and not any(w in m for w in WAITS)]


DUNDERS = ("__add__", "__mul__", "__matmul__", "__eq__", "__getitem__", "__call__", "__repr__", "__copy__", "__bool__")


def _count(call: Any) -> int:
    """How many arguments a call takes without those that have defaults."""
    try:
        parameters = inspect.signature(call).parameters.values()
    except (TypeError, ValueError):
        return 1
    return sum(p.default is p.empty and p.kind in (p.POSITIONAL_ONLY, p.POSITIONAL_OR_KEYWORD) for p in parameters)


def odd_calls(chance: random.Random, number: int) -> None:
    """Some calls on one world, then the scene that none of them concerns."""
    world = _world()
    for _ in range(CALLS):
        target = chance.choice(world)
        if chance.random() < 0.25:
            name, call = chance.choice(_public())
        else:
            name = chance.choice(_methods(type(target)))
            try:
                call = getattr(target, name)
            except Exception as error:
                _fine(error, name)
                continue
            if not callable(call):
                continue
        arguments = [
            chance.choice(world) if chance.random() < 0.35 else chance.choice(_values(chance))()
            for _ in range(max(0, _count(call) + chance.choice((0, 0, 0, 0, 1, 2, -1))))
        ]
        _make(name, call, arguments, world)
    if number % 5 == 0:
        assert _bits() == _first_bits(), "a scene of others has other bits"


def _make(name: str, call: Any, arguments: list[Any], world: list[Any]) -> None:
    if name in LONG and any(isinstance(a, (int, float)) and abs(a) > 1.0 for a in arguments):
        return
    texts = io.StringIO()
    try:
        with contextlib.redirect_stdout(texts), np.errstate(all="ignore"):
            found = call(*arguments)
    except Exception as error:
        _fine(error, f"{name}({', '.join(map(_short, arguments))})")
    else:
        if found is not None and type(found).__module__.startswith("sheldrake") and not inspect.isgenerator(found):
            world[-1] = found  # may be used next


def _short(value: Any) -> str:
    return f"{value!r}"[:80].replace("\n", " ")


def _fine(error: Exception, name: str) -> None:
    """An exception that says something."""
    assert not isinstance(error, (SystemError, UnboundLocalError, NameError)), f"{name}: {error!r}"
    assert str(error) or isinstance(error, (StopIteration, KeyError)), f"{name}: {type(error).__name__} without a word"


def _bits() -> bytes:
    builder = DiagramBuilder()
    plant, _ = AddMultibodyPlantSceneGraph(builder, 1e-3)
    Parser(plant).AddModelsFromString(MODEL, "urdf")
    plant.Finalize()
    simulator = Simulator(builder.Build())
    simulator.AdvanceTo(0.005)
    return plant.GetMyContextFromRoot(simulator.get_context()).get_discrete_state_vector().value().tobytes()


@functools.cache
def _first_bits() -> bytes:
    os.chdir(tempfile.mkdtemp(prefix="torture-"))  # for what is written to names of chance
    return _bits()
