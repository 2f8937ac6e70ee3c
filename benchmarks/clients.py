"""Programs as users write them, with sheldrake and with Drake: CPU time, time on the clock, and the cost reached.

    python benchmarks/clients.py [--only acrobot "cart-pole"] [--solver Ipopt] [--repeat 5] [--whole]

Each program runs with either library in a process of its own, whole: models, costs, constraints and the solve, five
times; the best of the later runs counts, the first one (which loads and may compile) stands in brackets. Trajectory
optimizations are solved by what `Solve` chooses, or by the solver of a name.

With `--whole` processes are measured from their start to their end, as a script is that runs once: Python, the import
of all of a library, and the program. The libraries take turns; the medians of so many processes count.
"""

from __future__ import annotations

import argparse
import gc
import importlib
import json
import os
import pathlib
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from typing import Any

import numpy as np

ROOT = pathlib.Path(__file__).resolve().parents[1]
sys.path[:0] = [str(ROOT), str(ROOT / "src")]

from benchmarks.robots import arm_urdf  # noqa: E402
from benchmarks.turns import machine  # noqa: E402

PROGRAMS: dict[str, Callable[[Any, str], tuple[str, float]]] = {}
PACKAGES = ("sheldrake", "pydrake")
LIMIT = 120.0  # [s] for all runs of a program


def program(title: str) -> Callable:
    """Adds a function of the library and the name of a solver, which returns how the solve ended and its cost."""

    def add(function: Callable) -> Callable:
        PROGRAMS[title] = function
        return function

    return add


def solved(lib: Any, prog: Any, solver: str) -> tuple[str, float]:
    chosen = lib.SolverId(solver) if solver else lib.ChooseBestSolver(prog)
    result = lib.MakeSolver(chosen).Solve(prog)
    return f"{result.get_solver_id().name()}{'' if result.is_success() else ' FAILED'}", result.get_optimal_cost()


def line(lib: Any, start: Any, end: Any, duration: float) -> Any:
    return lib.PiecewisePolynomial.FirstOrderHold([0.0, duration], np.column_stack([start, end]))


def pin(prog: Any, variables: Any, values: Any) -> None:
    prog.AddBoundingBoxConstraint(np.asarray(values, dtype=float), np.asarray(values, dtype=float), variables)


@program("double integrator")
def double_integrator(lib: Any, solver: str) -> tuple[str, float]:
    system = lib.LinearSystem([[0.0, 1.0], [0.0, 0.0]], [[0.0], [1.0]], np.eye(2), np.zeros((2, 1)))
    traj = lib.DirectCollocation(system, system.CreateDefaultContext(), 41, 0.02, 0.3)
    prog = traj.prog()
    traj.AddEqualTimeIntervalsConstraints()
    u = traj.input()[0]
    traj.AddConstraintToAllKnotPoints(u <= 1.0)
    traj.AddConstraintToAllKnotPoints(u >= -1.0)
    pin(prog, traj.initial_state(), [-2.0, 0.0])
    pin(prog, traj.final_state(), [0.0, 0.0])
    traj.AddRunningCost(0.1 * u * u)
    traj.AddFinalCost(traj.time()[0])
    traj.SetInitialTrajectory(lib.PiecewisePolynomial(), line(lib, [-2.0, 0.0], [0.0, 0.0], 4.0))
    return solved(lib, prog, solver)


@program("pendulum")
def pendulum(lib: Any, solver: str) -> tuple[str, float]:
    plant = importlib.import_module(f"{lib.__name__.split('.')[0]}.examples").PendulumPlant()
    traj = lib.DirectCollocation(plant, plant.CreateDefaultContext(), 31, 0.05, 0.4)
    prog = traj.prog()
    traj.AddEqualTimeIntervalsConstraints()
    u = traj.input()[0]
    traj.AddConstraintToAllKnotPoints(u <= 3.0)
    traj.AddConstraintToAllKnotPoints(u >= -3.0)
    pin(prog, traj.initial_state(), [0.0, 0.0])
    pin(prog, traj.final_state(), [np.pi, 0.0])
    traj.AddRunningCost(5.0 * u * u)
    traj.SetInitialTrajectory(lib.PiecewisePolynomial(), line(lib, [0.0, 0.0], [np.pi, 0.0], 4.0))
    return solved(lib, prog, solver)


@program("pendulum, transcribed")
def transcribed_pendulum(lib: Any, solver: str) -> tuple[str, float]:
    """Explicit Euler between samples."""
    plant = importlib.import_module(f"{lib.__name__.split('.')[0]}.examples").PendulumPlant()
    step = lib.DirectTranscription.TimeStep(0.1)
    traj = lib.DirectTranscription(plant, plant.CreateDefaultContext(), 31, step)
    u = traj.input()[0]
    traj.AddConstraintToAllKnotPoints(u <= 3.0)
    traj.AddConstraintToAllKnotPoints(u >= -3.0)
    pin(traj.prog(), traj.initial_state(), [0.0, 0.0])
    pin(traj.prog(), traj.final_state(), [np.pi, 0.0])
    traj.AddRunningCost(u * u)
    traj.SetInitialTrajectory(lib.PiecewisePolynomial(), line(lib, [0.0, 0.0], [np.pi, 0.0], 3.0))
    return solved(lib, traj.prog(), solver)


@program("acrobot")
def acrobot(lib: Any, solver: str) -> tuple[str, float]:
    plant = importlib.import_module(f"{lib.__name__.split('.')[0]}.examples").AcrobotPlant()
    traj = lib.DirectCollocation(plant, plant.CreateDefaultContext(), 21, 0.05, 0.2)
    prog = traj.prog()
    traj.AddEqualTimeIntervalsConstraints()
    u = traj.input()[0]
    traj.AddConstraintToAllKnotPoints(u <= 10.0)
    traj.AddConstraintToAllKnotPoints(u >= -10.0)
    pin(prog, traj.initial_state(), [0.0, 0.0, 0.0, 0.0])
    pin(prog, traj.final_state(), [np.pi, 0.0, 0.0, 0.0])
    traj.AddRunningCost(10.0 * u * u)
    traj.SetInitialTrajectory(lib.PiecewisePolynomial(), line(lib, np.zeros(4), [np.pi, 0.0, 0.0, 0.0], 4.0))
    return solved(lib, prog, solver)


CART_POLE = """<robot name="cart_pole"><link name="world"/>
  <link name="cart"><inertial><mass value="10"/><inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial>
  </link><link name="pole"><inertial><origin xyz="0 0 -0.5"/><mass value="1"/>
  <inertia ixx="0.01" iyy="0.01" izz="0.01" ixy="0" ixz="0" iyz="0"/></inertial></link>
  <joint name="slide" type="prismatic"><parent link="world"/><child link="cart"/><axis xyz="1 0 0"/>
  <limit effort="200" lower="-4" upper="4" velocity="20"/></joint>
  <joint name="swing" type="continuous"><parent link="cart"/><child link="pole"/><axis xyz="0 -1 0"/></joint>
  <transmission name="push"><type>transmission_interface/SimpleTransmission</type><joint name="slide"/>
  <actuator name="push"/></transmission></robot>"""


@program("cart-pole")
def cart_pole(lib: Any, solver: str) -> tuple[str, float]:
    plant = lib.MultibodyPlant(0.0)
    lib.Parser(plant).AddModelsFromString(CART_POLE, "urdf")
    plant.Finalize()
    port = plant.get_actuation_input_port().get_index()
    traj = lib.DirectCollocation(
        plant, plant.CreateDefaultContext(), 21, 0.1, 0.4, port, assume_non_continuous_states_are_fixed=True
    )
    prog = traj.prog()
    traj.AddEqualTimeIntervalsConstraints()
    u = traj.input()[0]
    pin(prog, traj.initial_state(), np.zeros(4))
    pin(prog, traj.final_state(), [0.0, np.pi, 0.0, 0.0])
    traj.AddRunningCost(10.0 * u * u)
    traj.SetInitialTrajectory(lib.PiecewisePolynomial(), line(lib, np.zeros(4), [0.0, np.pi, 0.0, 0.0], 4.0))
    return solved(lib, prog, solver)


def leaf(lib: Any, states: int, inputs: int, derivatives: Callable) -> Any:
    """A system in Python on every scalar; `derivatives` takes x, u and the library's module of functions."""
    from importlib import import_module

    name = lib.__name__.split(".")[0]
    template = import_module(f"{name}.systems.scalar_conversion").TemplateSystem

    @template.define("Motion_")
    def Motion_(T: Any) -> type:
        class Impl(lib.LeafSystem_[T]):
            def _construct(self, converter: Any = None) -> None:
                super().__init__(converter)
                self.DeclareVectorInputPort("u", inputs)
                self.DeclareContinuousState(states)

            def _construct_copy(self, other: Any, converter: Any = None) -> None:
                Impl._construct(self, converter=converter)

            def DoCalcTimeDerivatives(self, context: Any, out: Any) -> None:
                x = context.get_continuous_state_vector().CopyToVector()
                u = self.EvalVectorInput(context, 0).CopyToVector()
                out.get_mutable_vector().SetFromVector(derivatives(x, u, import_module(f"{name}.math")))

        return Impl

    return Motion_[None]()


@program("orbital transfer")
def orbital_transfer(lib: Any, solver: str) -> tuple[str, float]:
    """From one circle to a higher one with least thrust; polar coordinates, units in which gravity is 1."""

    def motion(x: np.ndarray, u: np.ndarray, m: Any) -> np.ndarray:
        r, _, vr, vt = x
        return np.array([vr, vt / r, vt * vt / r - 1.0 / (r * r) + u[0], -vr * vt / r + u[1]])

    system = leaf(lib, 4, 2, motion)
    traj = lib.DirectCollocation(system, system.CreateDefaultContext(), 41, 0.05, 0.3)
    prog = traj.prog()
    traj.AddEqualTimeIntervalsConstraints()
    u, x = traj.input(), traj.state()
    radius = 1.5
    traj.AddConstraintToAllKnotPoints(u[0] ** 2 + u[1] ** 2 <= 0.01)
    traj.AddConstraintToAllKnotPoints(x[0] >= 0.5)
    pin(prog, traj.initial_state(), [1.0, 0.0, 0.0, 1.0])
    final = traj.final_state()
    pin(prog, final[[0, 2, 3]], [radius, 0.0, radius**-0.5])
    traj.AddRunningCost(u.dot(u))
    start, end = [1.0, 0.0, 0.0, 1.0], [radius, 5.0, 0.0, radius**-0.5]
    traj.SetInitialTrajectory(lib.PiecewisePolynomial(), line(lib, start, end, 6.0))
    return solved(lib, prog, solver)


@program("planar quadrotor")
def planar_quadrotor(lib: Any, solver: str) -> tuple[str, float]:
    """A flip of pi about its axis while it moves sideways."""

    def motion(x: np.ndarray, u: np.ndarray, m: Any) -> np.ndarray:
        lift = u[0] + u[1]
        ax, ay = -m.sin(x[2]) * lift / 0.486, m.cos(x[2]) * lift / 0.486 - 9.81
        return np.array([x[3], x[4], x[5], ax, ay, 0.25 * (u[0] - u[1]) / 0.00383])

    system = leaf(lib, 6, 2, motion)
    traj = lib.DirectCollocation(system, system.CreateDefaultContext(), 31, 0.02, 0.15)
    prog = traj.prog()
    traj.AddEqualTimeIntervalsConstraints()
    u = traj.input()
    for one in u:
        traj.AddConstraintToAllKnotPoints(one <= 6.0)
        traj.AddConstraintToAllKnotPoints(one >= 0.0)
    end = [2.0, 0.0, 2.0 * np.pi, 0.0, 0.0, 0.0]
    pin(prog, traj.initial_state(), np.zeros(6))
    pin(prog, traj.final_state(), end)
    traj.AddRunningCost((u - 2.4).dot(u - 2.4))
    traj.SetInitialTrajectory(line(lib, [2.4, 2.4], [2.4, 2.4], 2.0), line(lib, np.zeros(6), end, 2.0))
    return solved(lib, prog, solver)


@program("van der Pol cycle")
def van_der_pol(lib: Any, solver: str) -> tuple[str, float]:
    """The limit cycle: periodic, through a section; no input."""
    plant = importlib.import_module(f"{lib.__name__.split('.')[0]}.examples").VanDerPolOscillator()
    context = plant.CreateDefaultContext()
    traj = lib.DirectCollocation(plant, context, 61, 0.01, 0.5, lib.InputPortSelection.kNoInput)
    prog = traj.prog()
    traj.AddEqualTimeIntervalsConstraints()
    first, last = traj.initial_state(), traj.final_state()
    prog.AddLinearConstraint(first[0] == 0.0)
    prog.AddLinearConstraint(first[1] >= 0.1)
    prog.AddLinearEqualityConstraint(first[0] - last[0], 0.0)
    prog.AddLinearEqualityConstraint(first[1] - last[1], 0.0)
    traj.AddFinalCost(traj.time()[0])
    angles = np.linspace(0.0, 2.0 * np.pi, 61)
    circle = np.vstack([2.0 * np.sin(angles), 2.0 * np.cos(angles)])
    times = np.linspace(0.0, 6.0, 61)
    traj.SetInitialTrajectory(lib.PiecewisePolynomial(), lib.PiecewisePolynomial.FirstOrderHold(times, circle))
    return solved(lib, prog, solver)


@program("compass gait")
def compass_gait(lib: Any, solver: str) -> tuple[str, float]:
    """A periodic step down a slope, with a motor at the hip: collision by symmetric legs at the end."""
    package = lib.__name__.split(".")[0]
    plant = importlib.import_module(f"{package}.examples").CompassGait()
    context = plant.CreateDefaultContext()
    params = context.get_numeric_parameter(0)
    m, mh, a, b = params.mass_leg(), params.mass_hip(), params.center_of_mass_leg(), 0.0
    length, slope = params.length_leg(), params.slope()
    b = length - a
    port = lib.InputPortIndex(0) if hasattr(lib, "InputPortIndex") else 0
    traj = lib.DirectCollocation(plant, context, 17, 0.01, 0.1, port, assume_non_continuous_states_are_fixed=True)
    prog = traj.prog()
    traj.AddEqualTimeIntervalsConstraints()
    first, last = traj.initial_state(), traj.final_state()
    # Both feet on the ground at either end; legs swap.
    for x in (first, last):
        prog.AddLinearConstraint(x[0] + x[1] == 2.0 * slope)
    prog.AddLinearConstraint(first[0] - last[1] == 0.0)
    prog.AddLinearConstraint(first[0] - first[1] >= 0.2)
    maths = importlib.import_module(f"{package}.math")

    def impact(z: np.ndarray) -> np.ndarray:
        """Angular momentum about the new foot, and about the hip of the old stance leg, is kept."""
        st, sw, st_dot, sw_dot, nst_dot, nsw_dot = z
        c = maths.cos(sw - st)
        before1 = (mh * length**2 + 2.0 * m * a * length) * c * st_dot - m * a * b * (st_dot + sw_dot)
        before2 = -m * a * b * st_dot
        M11 = m * length**2 + mh * length**2 + m * a**2 - m * length * b * c
        M12 = m * b * (b - length * c)
        after1 = M11 * nst_dot + M12 * nsw_dot
        after2 = -m * length * b * c * nst_dot + m * b * b * nsw_dot
        return np.array([before1 - after1, before2 - after2])

    crossing = np.array([last[0], last[1], last[2], last[3], first[2], first[3]])
    prog.AddConstraint(impact, np.zeros(2), np.zeros(2), crossing)
    u = traj.input()
    traj.AddRunningCost(u.dot(u))
    start, end = [0.3, -0.2, -1.2, -0.3], [-0.2, 0.3, -1.2, 1.5]
    traj.SetInitialTrajectory(lib.PiecewisePolynomial(), line(lib, start, end, 0.6))
    return solved(lib, prog, solver)


def spheres_urdf() -> str:
    """The arm with two spheres, and a box to reach around."""
    text = arm_urdf()
    for k in (4, 7):
        mark = f'<link name="link{k}">'
        geometry = '<collision><geometry><sphere radius="0.04"/></geometry></collision>'
        text = text.replace(mark, mark + geometry)
    return text


def station(lib: Any) -> tuple[Any, Any, Any]:
    builder = lib.DiagramBuilder()
    plant, scene_graph = lib.AddMultibodyPlantSceneGraph(builder, 0.0)
    lib.Parser(plant).AddModelsFromString(spheres_urdf(), "urdf")
    box = lib.RigidTransform([0.28, 0.0, 0.12])
    plant.RegisterCollisionGeometry(plant.world_body(), box, lib.Box(0.15, 0.4, 0.1), "box", lib.CoulombFriction(1, 1))
    plant.Finalize()
    return builder.Build(), plant, scene_graph


@program("IK, minimum distance")
def inverse_kinematics(lib: Any, solver: str) -> tuple[str, float]:
    """Ten targets around a box."""
    diagram, plant, _ = station(lib)
    context = diagram.CreateDefaultContext()
    plant_context = plant.GetMyContextFromRoot(context)
    total, names = 0.0, set()
    rng = np.random.default_rng(3)
    for _ in range(10):
        ik = lib.InverseKinematics(plant, plant_context)
        tip, world = plant.GetFrameByName("link7"), plant.world_frame()
        plant.SetPositions(plant_context, rng.uniform(-1.2, 1.2, plant.num_positions()))
        target = plant.CalcPointsPositions(plant_context, tip, np.zeros(3), world).ravel()
        ik.AddPositionConstraint(tip, np.zeros(3), world, target - 0.005, target + 0.005)
        ik.AddMinimumDistanceLowerBoundConstraint(0.02, 0.05)
        prog, q = ik.prog(), ik.q()
        nominal = np.full(len(q), 0.3)
        prog.AddQuadraticErrorCost(np.eye(len(q)), nominal, q)
        prog.SetInitialGuess(q, nominal + rng.uniform(-0.2, 0.2, len(q)))
        name, cost = solved(lib, prog, solver)
        names.add(name)
        total += cost
    return "/".join(sorted(names)), total


@program("postures without distances")
def postures(lib: Any, solver: str) -> tuple[str, float]:
    """Twenty of an arm, near a mean posture, for a position, an orientation and a target to look at."""
    plant = lib.MultibodyPlant(0.0)
    lib.Parser(plant).AddModelsFromString(arm_urdf(), "urdf")
    plant.Finalize()
    context, rng = plant.CreateDefaultContext(), np.random.default_rng(1)
    tip, world, zero, total, names = plant.GetFrameByName("link7"), plant.world_frame(), np.zeros(3), 0.0, set()
    for _ in range(20):
        plant.SetPositions(context, rng.uniform(-1.2, 1.2, 7))
        X = plant.CalcRelativeTransform(context, world, tip)
        ik = lib.InverseKinematics(plant, context)
        ik.AddPositionConstraint(tip, zero, world, X.translation() - 0.01, X.translation() + 0.01)
        ik.AddOrientationConstraint(world, X.rotation(), tip, lib.RotationMatrix(), 0.3)
        ik.AddGazeTargetConstraint(tip, zero, [0.0, 0.0, 1.0], world, X @ [0.3, 0.2, 1.0], 0.6)
        ik.prog().AddQuadraticErrorCost(np.eye(7), np.full(7, 0.3), ik.q())
        ik.prog().SetInitialGuess(ik.q(), 0.3 + rng.uniform(-0.3, 0.3, 7))
        name, cost = solved(lib, ik.prog(), solver)
        names.add(name)
        total += cost
    return "/".join(sorted(names)), total


@program("kinematic trajectory")
def kinematic_trajectory(lib: Any, solver: str) -> tuple[str, float]:
    """From one side of a box to the other: least length and duration, distances kept at 15 times."""
    diagram, plant, _ = station(lib)
    context = diagram.CreateDefaultContext()
    plant_context = plant.GetMyContextFromRoot(context)
    n = plant.num_positions()
    trajopt = lib.KinematicTrajectoryOptimization(n, 10)
    prog = trajopt.get_mutable_prog()
    start, end = np.full(n, 0.2), np.full(n, 0.2)
    start[0], end[0] = -0.9, 0.9
    trajopt.AddDurationCost(1.0)
    trajopt.AddPathLengthCost(1.0)
    trajopt.AddPositionBounds(np.full(n, -2.5), np.full(n, 2.5))
    trajopt.AddVelocityBounds(np.full(n, -2.0), np.full(n, 2.0))
    trajopt.AddDurationConstraint(0.5, 5.0)
    trajopt.AddPathPositionConstraint(start, start, 0.0)
    trajopt.AddPathPositionConstraint(end, end, 1.0)
    for s in (0.0, 1.0):
        trajopt.AddPathVelocityConstraint(np.zeros(n), np.zeros(n), s)
    distance = lib.MinimumDistanceLowerBoundConstraint(plant, 0.01, plant_context, None, 0.05)
    for s in np.linspace(0.0, 1.0, 15):
        trajopt.AddPathPositionConstraint(distance, s)
    return solved(lib, prog, solver)


@program("region of attraction")
def region_of_attraction(lib: Any, solver: str) -> tuple[str, float]:
    """Sum of squares: the set-up is what takes time. Cubic dynamics of four states, multiplier of degree 2."""
    prog = lib.MathematicalProgram()
    x = prog.NewIndeterminates(4, "x")
    f = np.array([x[1], -x[0] - x[1] + x[0] ** 3 / 6.0, x[3], -x[2] - x[3] + 0.2 * x[0] * x[2] + x[2] ** 3 / 6.0])
    A = np.array([[0, 1, 0, 0], [-1, -1, 0, 0], [0, 0, 0, 1], [0, 0, -1, -1]], dtype=float)
    P = lib.RealContinuousLyapunovEquation(A, np.eye(4))
    V = x.dot(P.dot(x))
    Vdot = lib.Jacobian([V], x).dot(f)[0]
    rho = prog.NewContinuousVariables(1, "rho")[0]
    multiplier = prog.NewFreePolynomial(lib.Variables(x), 2).ToExpression()
    norm = x.dot(x)
    prog.AddSosConstraint((norm * (V - rho)) + multiplier * Vdot)
    prog.AddLinearCost(-rho)
    return solved(lib, prog, "")


@program("value function by sums of squares")
def value_function(lib: Any, solver: str) -> tuple[str, float]:
    """A lower bound of degree 4 of the cost-to-go of a polynomial system, as large as can be at samples."""
    prog = lib.MathematicalProgram()
    z = prog.NewIndeterminates(3, "z")
    u = prog.NewIndeterminates(1, "u")[0]
    f = np.array([z[1] * z[2], -z[0] * z[2], -9.81 * z[0] - 0.1 * z[2] + u])
    J = prog.NewFreePolynomial(lib.Variables(z), 4)
    cost = z[0] ** 2 + (z[1] - 1.0) ** 2 + z[2] ** 2 + u**2
    J_dot = J.Jacobian(z)
    rhs = lib.Polynomial(cost)
    bellman = rhs + sum((J_dot[i] * lib.Polynomial(f[i]) for i in range(3)), lib.Polynomial(0.0 * u))
    ring = prog.NewFreePolynomial(lib.Variables(np.append(z, u)), 4)
    circle = lib.Polynomial(z[0] ** 2 + z[1] ** 2 - 1.0)
    box = prog.NewSosPolynomial(lib.Variables(np.append(z, u)), 4)[0]
    bellman = bellman + ring * circle - box * lib.Polynomial(9.0 - z[2] ** 2)
    prog.AddSosConstraint(bellman)
    at_goal = J.EvaluatePartial({z[0]: 0.0, z[1]: 1.0, z[2]: 0.0})
    for coefficient in at_goal.monomial_to_coefficient_map().values():
        prog.AddLinearConstraint(coefficient == 0.0)
    for angle in np.linspace(0.0, 2.0 * np.pi, 12):
        for speed in (-2.0, 0.0, 2.0):
            there = J.EvaluatePartial({z[0]: np.sin(angle), z[1]: np.cos(angle), z[2]: speed})
            for coefficient in there.monomial_to_coefficient_map().values():
                prog.AddLinearCost(-coefficient)
    return solved(lib, prog, "")


@program("cells of a value iteration")
def cells(lib: Any, solver: str) -> tuple[str, float]:
    """Quadratic polynomials of many cells, substituted by the dynamics and made linear programs at samples."""
    x = np.array([lib.Variable("x"), lib.Variable("v")])
    u = lib.Variable("u")
    total = 0.0
    for i in range(15):
        prog = lib.MathematicalProgram()
        prog.AddIndeterminates(np.append(x, u))
        V = prog.NewFreePolynomial(lib.Variables(x), 4)
        W = prog.NewFreePolynomial(lib.Variables(np.append(x, u)), 2)
        dt = 0.1
        following = {x[0]: lib.Polynomial(x[0] + dt * x[1]), x[1]: lib.Polynomial(x[1] + dt * (u - x[0] + x[0] ** 3))}
        moved = V.SubstituteAndExpand(following)
        difference = V - moved - W * lib.Polynomial(x[0] ** 2 + x[1] ** 2 - 1.0 - 0.1 * i)
        prog.AddEqualityConstraintBetweenPolynomials(V, lib.Polynomial(x[0] ** 2 + 2.0 * x[1] ** 2))
        total += sum(
            c.Evaluate({v: 1.0 for v in c.GetVariables()}) for c in difference.monomial_to_coefficient_map().values()
        )
    return "", total


@program("small programs")
def small_programs(lib: Any, solver: str) -> tuple[str, float]:
    """Twenty of two to eight variables, written anew: half by symbols, half by functions of Python."""
    rng, names, total = np.random.default_rng(2), set(), 0.0
    for k in range(20):
        n = 2 + k % 7
        a, start = rng.normal(size=(2, n)), rng.normal(size=n)
        prog = lib.MathematicalProgram()
        x = prog.NewContinuousVariables(n, "x")

        def cost(z: Any, a: Any = a) -> Any:
            return (a[0].dot(z) - 1.0) ** 4 + (z - a[1]).dot(z - a[1])

        if k % 2:
            prog.AddCost(cost(x))
            prog.AddConstraint(x.dot(x) <= 1.5)
            prog.AddConstraint(x[0] * x[1] + a[0].dot(x) == 0.2)
        else:
            prog.AddCost(cost, x)
            prog.AddConstraint(
                lambda z, a=a: np.array([z.dot(z), z[0] * z[1] + a[0].dot(z)]), [-np.inf, 0.2], [1.5, 0.2], x
            )
        prog.SetInitialGuess(x, start)
        how, least = solved(lib, prog, solver)
        names.add(how)
        total += least
    return "/".join(sorted(names)), total


@program("predictive control")
def predictive_control(lib: Any, solver: str) -> tuple[str, float]:
    """A double integrator under limits, its program written anew by symbols at each of 20 steps."""
    A, B = np.array([[1.0, 0.1], [0.0, 1.0]]), np.array([[0.005], [0.1]])
    x0, total, names = np.array([-2.0, 0.3]), 0.0, set()
    for _ in range(20):
        prog = lib.MathematicalProgram()
        x, u = prog.NewContinuousVariables(2, 16, "x"), prog.NewContinuousVariables(1, 15, "u")
        prog.AddBoundingBoxConstraint(x0, x0, x[:, 0])
        for k in range(15):
            for row in range(2):
                prog.AddLinearConstraint(x[row, k + 1] == A[row].dot(x[:, k]) + B[row, 0] * u[0, k])
            prog.AddLinearConstraint(u[0, k] <= 1.0)
            prog.AddLinearConstraint(u[0, k] >= -1.0)
            prog.AddQuadraticCost(x[:, k].dot(x[:, k]) + 0.1 * u[0, k] ** 2)
        prog.AddQuadraticCost(10.0 * x[:, 15].dot(x[:, 15]))
        result = lib.Solve(prog)
        names.add(result.get_solver_id().name())
        total += result.get_optimal_cost()
        x0 = A @ x0 + B @ result.GetSolution(u)[:, 0]
    return "/".join(sorted(names)), total


@program("graph of convex sets")
def graph_of_convex_sets(lib: Any, solver: str) -> tuple[str, float]:
    """A shortest smooth path through the free boxes of a small maze."""
    gcs = lib.GcsTrajectoryOptimization(2)
    boxes = [
        ([0.0, 0.0], [1.0, 4.0]), ([0.0, 3.0], [4.0, 4.0]), ([3.0, 0.0], [4.0, 4.0]), ([3.0, 0.0], [6.0, 1.0]),
        ([0.0, 1.5], [4.0, 2.0]), ([5.0, 0.0], [6.0, 4.0]), ([3.0, 2.5], [6.0, 3.2]),
    ]  # fmt: skip
    regions = gcs.AddRegions([lib.HPolyhedron.MakeBox(low, high) for low, high in boxes], 4, 0.1, 10.0, "maze")
    start = gcs.AddRegions([lib.Point([0.2, 0.2])], 0, name="start")
    end = gcs.AddRegions([lib.Point([5.8, 3.8])], 0, name="end")
    gcs.AddEdges(start, regions)
    gcs.AddEdges(regions, end)
    gcs.AddTimeCost(1.0)
    gcs.AddPathLengthCost(1.0)
    gcs.AddVelocityBounds(np.full(2, -1.0), np.full(2, 1.0))
    gcs.AddPathContinuityConstraints(1)
    options = lib.GraphOfConvexSetsOptions()
    options.preprocessing, options.max_rounded_paths = True, 5
    _, result = gcs.SolvePath(start, end, options)
    return f"{result.get_solver_id().name()}{'' if result.is_success() else ' FAILED'}", result.get_optimal_cost()


@program("timing of a path")
def timing(lib: Any, solver: str) -> tuple[str, float]:
    """The fastest way along a spline under limits of velocity, acceleration and torque (Toppra)."""
    _diagram, plant, _ = station(lib)
    n = plant.num_positions()
    knots = np.array([np.sin(0.7 * k + np.arange(n)) for k in range(6)]).T
    path = lib.PiecewisePolynomial.CubicShapePreserving(np.linspace(0.0, 1.0, 6), knots, True)
    grid = lib.Toppra.CalcGridPoints(path, lib.CalcGridPointsOptions())
    toppra = lib.Toppra(path, plant, grid)
    toppra.AddJointVelocityLimit(np.full(n, -2.0), np.full(n, 2.0))
    toppra.AddJointAccelerationLimit(np.full(n, -8.0), np.full(n, 8.0))
    toppra.AddJointTorqueLimit(np.full(n, -80.0), np.full(n, 80.0))
    times = toppra.SolvePathParameterization()
    return "Toppra", times.end_time()


@program("iLQR")
def ilqr(lib: Any, solver: str) -> tuple[str, float]:
    """iLQR by hand: derivatives of a cart-pole's steps with AutoDiffXd, four sweeps over 30 steps."""
    plant = lib.MultibodyPlant(0.0)
    lib.Parser(plant).AddModelsFromString(CART_POLE, "urdf")
    plant.Finalize()
    dual = plant.ToAutoDiffXd()
    context, dual_context = plant.CreateDefaultContext(), dual.CreateDefaultContext()
    port, dual_port = plant.get_actuation_input_port(), dual.get_actuation_input_port()
    dt, N = 0.05, 30
    Q, R, Qf, goal = 0.1 * np.eye(4), 0.01, 50.0 * np.eye(4), np.array([0.0, np.pi, 0.0, 0.0])

    def step(x, u):
        plant.SetPositionsAndVelocities(context, x)
        port.FixValue(context, u)
        return x + dt * plant.EvalTimeDerivatives(context).CopyToVector()

    def slopes(x, u):
        z = lib.InitializeAutoDiff(np.concatenate([x, u])).ravel()
        dual.SetPositionsAndVelocities(dual_context, z[:4])
        dual_port.FixValue(dual_context, z[4:])
        following = z[:4] + dt * dual.EvalTimeDerivatives(dual_context).CopyToVector()
        J = lib.ExtractGradient(following)
        return J[:, :4], J[:, 4:]

    xs, us = [np.array([0.0, 0.3, 0.0, 0.0])], [np.zeros(1) for _ in range(N)]
    for u in us:
        xs.append(step(xs[-1], u))

    def cost(xs, us):
        end = xs[-1] - goal
        return sum(((x - goal) @ Q @ (x - goal) + R * u @ u) for x, u in zip(xs, us)) + end @ Qf @ end

    best = cost(xs, us)
    for _ in range(4):
        Vx, Vxx, gains = Qf @ (xs[-1] - goal), Qf, []
        for x, u in zip(xs[-2::-1], us[::-1]):
            A, B = slopes(x, u)
            Qx, Qu = Q @ (x - goal) + A.T @ Vx, R * u + B.T @ Vx
            Qxx, Quu, Qux = Q + A.T @ Vxx @ A, R + B.T @ Vxx @ B, B.T @ Vxx @ A
            k, K = -np.linalg.solve(Quu, Qu), -np.linalg.solve(Quu, Qux)
            gains.append((k, K))
            Vx, Vxx = Qx + K.T @ Quu @ k + K.T @ Qu + Qux.T @ k, Qxx + K.T @ Quu @ K + K.T @ Qux + Qux.T @ K
        for scale in (1.0, 0.5, 0.25, 0.1):
            ys, vs = [xs[0]], []
            for x, u, (k, K) in zip(xs, us, gains[::-1]):
                vs.append(u + scale * k + K @ (ys[-1] - x))
                ys.append(step(ys[-1], vs[-1]))
            if np.isfinite(ys[-1]).all() and cost(ys, vs) < best:
                xs, us, best = ys, vs, cost(ys, vs)
                break
    return "iLQR", float(best)


@program("differential inverse kinematics")
def diffik(lib: Any, solver: str) -> tuple[str, float]:
    """A seven-joint arm whose tip goes around a circle: Jacobian, quadratic program with limits; 100 steps."""
    plant = lib.MultibodyPlant(0.0)
    lib.Parser(plant).AddModelsFromString(arm_urdf(), "urdf")
    plant.Finalize()
    context = plant.CreateDefaultContext()
    tip, world = plant.GetFrameByName("link7"), plant.world_frame()
    q = np.full(7, 0.4)
    total = 0.0
    for k in range(100):
        plant.SetPositions(context, q)
        J = plant.CalcJacobianSpatialVelocity(context, lib.JacobianWrtVariable.kV, tip, np.zeros(3), world, world)
        V = np.array([0.0, 0.1, 0.0, 0.2 * np.cos(0.06 * k), 0.2 * np.sin(0.06 * k), 0.05])
        prog = lib.MathematicalProgram()
        v = prog.NewContinuousVariables(7, "v")
        prog.Add2NormSquaredCost(J, V, v)
        prog.AddQuadraticCost(1e-3 * np.eye(7), np.zeros(7), v)
        prog.AddBoundingBoxConstraint(-1.0, 1.0, v)
        result = lib.Solve(prog)
        q = q + 0.02 * result.GetSolution(v)
        total += float(result.get_optimal_cost())
    return result.get_solver_id().name(), total + float(q.sum())


@program("tree of configurations")
def rrt(lib: Any, solver: str) -> tuple[str, float]:
    """A rapidly exploring random tree with a collision checker."""
    diagram, plant, _ = station(lib)
    context = diagram.CreateDefaultContext()
    plant_context = plant.GetMyContextFromRoot(context)
    n = plant.num_positions()
    rng = np.random.default_rng(0)
    query_port = plant.get_geometry_query_input_port()

    def free(q):
        plant.SetPositions(plant_context, q)
        return not query_port.Eval(plant_context).HasCollisions()

    nodes = [np.zeros(n)]
    for _ in range(150):
        sample = rng.uniform(-1.5, 1.5, n)
        near = int(np.argmin(np.linalg.norm(np.array(nodes) - sample, axis=1)))
        step = sample - nodes[near]
        length = np.linalg.norm(step)
        new = nodes[near] + step * min(1.0, 0.3 / length)
        if all(free(nodes[near] + s * (new - nodes[near])) for s in np.linspace(0.1, 1.0, 6)):
            nodes.append(new)
    return "tree", float(len(nodes))


@program("regulator along a trajectory")
def tvlqr(lib: Any, solver: str) -> tuple[str, float]:
    """Time-varying LQR of an acrobot along a trajectory, then a simulation with it."""
    models = importlib.import_module(f"{lib.__name__.split('.')[0]}.examples")
    plant = models.AcrobotPlant()
    context = plant.CreateDefaultContext()
    times = np.linspace(0.0, 1.0, 11)
    states = np.array([[0.3 * np.sin(t), -0.2 * t, 0.3 * np.cos(t), -0.2] for t in times]).T
    x_traj = lib.PiecewisePolynomial.CubicShapePreserving(times, states)
    u_traj = lib.PiecewisePolynomial.FirstOrderHold(times, np.sin(times)[None, :])
    options = lib.FiniteHorizonLinearQuadraticRegulatorOptions()
    options.x0, options.u0, options.Qf = x_traj, u_traj, np.eye(4)
    regulator = lib.MakeFiniteHorizonLinearQuadraticRegulator(plant, context, 0.0, 1.0, np.eye(4), np.eye(1), options)
    builder = lib.DiagramBuilder()
    own = builder.AddSystem(models.AcrobotPlant())
    controller = builder.AddSystem(regulator)
    builder.Connect(own.get_output_port(0), controller.get_input_port(0))
    builder.Connect(controller.get_output_port(0), own.get_input_port(0))
    diagram = builder.Build()
    simulator = lib.Simulator(diagram)
    simulator.get_mutable_context().SetContinuousState(states[:, 0] + 0.01)
    simulator.AdvanceTo(1.0)
    return "TVLQR", float(np.sum(simulator.get_context().get_continuous_state_vector().CopyToVector()))


@program("system identification")
def sysid(lib: Any, solver: str) -> tuple[str, float]:
    """Lumped parameters of a cart-pole by symbols, then least squares over simulated data."""
    plant = lib.MultibodyPlant(0.0)
    lib.Parser(plant).AddModelsFromString(CART_POLE, "urdf")
    plant.Finalize()
    sym = plant.ToSymbolic()
    context = sym.CreateDefaultContext()
    q, v, vd, tau = (lib.MakeVectorVariable(2, s) for s in ("q", "v", "a", "t"))
    m = lib.Variable("m")
    sym.GetBodyByName("pole").SetMass(context, m)
    sym.SetPositions(context, q)
    sym.SetVelocities(context, v)
    sym.get_actuation_input_port().FixValue(context, [tau[0]])
    forces = lib.MultibodyForces_[lib.Expression](sym)
    sym.CalcForceElementsContribution(context, forces)
    residual = sym.CalcInverseDynamics(context, vd, forces)
    W, _, w0 = lib.DecomposeLumpedParameters(residual - np.array([tau[0], 0.0]), [m])
    rng = np.random.default_rng(0)
    rows, right = [], []
    for _ in range(40):
        env = dict(zip([*q, *v, *vd, tau[0]], rng.uniform(-1.0, 1.0, 7)))
        rows.append(lib.Evaluate(W, env))
        right.append(lib.Evaluate(w0, env))
    found = np.linalg.lstsq(np.vstack(rows), -np.vstack(right), rcond=None)[0]
    return "least squares", float(found.sum())


@program("antipodal grasps")
def grasps(lib: Any, solver: str) -> tuple[str, float]:
    """Clouds of a box from two sides: cropped, down-sampled, normals, candidates of grasps."""
    rng = np.random.default_rng(0)
    clouds = []
    for side in range(2):
        xyz = rng.uniform(-0.1, 0.1, (3, 4000))
        xyz[side] = 0.05
        cloud = lib.PointCloud(4000)
        cloud.mutable_xyzs()[:] = xyz
        cloud.EstimateNormals(0.1, 30)
        cloud.FlipNormalsTowardPoint([0.3, 0.3, 0.5])
        clouds.append(cloud)
    merged = lib.Concatenate(clouds).Crop([-0.09, -0.09, -0.09], [0.09, 0.09, 0.09]).VoxelizedDownSample(0.008)
    p, n = merged.xyzs().astype(float), merged.normals().astype(float)
    best = 0.0
    for i in range(merged.size()):
        R = lib.RotationMatrix.MakeFromOneVector(n[:, i], 0)
        for angle in (-0.5, 0.5):
            X = lib.RigidTransform(R @ lib.RotationMatrix.MakeXRotation(angle), p[:, i])
            inside = X.inverse() @ p
            between = (np.abs(inside) < [[0.05], [0.02], [0.03]]).all(axis=0)
            best = max(best, float(np.sum((n[:, between].T @ R.matrix()[:, 0]) ** 2)))
    return "grasps", round(best, 3)


TWO_LINKS = """<robot name="two">
<link name="base">
  <collision><origin xyz="0.6 0.4 0"/><geometry><sphere radius="0.2"/></geometry></collision>
  <collision><origin xyz="-0.5 0.5 0"/><geometry><box size="0.3 0.3 0.3"/></geometry></collision>
</link>
<link name="upper">
  <collision><origin xyz="0.25 0 0"/><geometry><box size="0.5 0.05 0.05"/></geometry></collision></link>
<link name="lower">
  <collision><origin xyz="0.25 0 0"/><geometry><box size="0.5 0.05 0.05"/></geometry></collision></link>
<joint name="shoulder" type="revolute"><parent link="base"/><child link="upper"/><axis xyz="0 0 1"/>
  <limit lower="-3" upper="3" effort="1" velocity="1"/></joint>
<joint name="elbow" type="revolute">
  <parent link="upper"/><child link="lower"/><origin xyz="0.5 0 0"/><axis xyz="0 0 1"/>
  <limit lower="-2.5" upper="2.5" effort="1" velocity="1"/></joint>
</robot>"""


@program("region of configurations")
def region_of_configurations(lib: Any, solver: str) -> tuple[str, float]:
    """A region of free configurations of two links; the cost is the volume of its largest ellipsoid."""
    builder = lib.RobotDiagramBuilder(time_step=0.0)
    builder.parser().AddModelsFromString(TWO_LINKS, "urdf")
    plant = builder.plant()
    plant.WeldFrames(plant.world_frame(), plant.GetFrameByName("base"))
    plant.Finalize()
    diagram = builder.Build()
    context = diagram.CreateDefaultContext()
    plant_context = diagram.mutable_plant_context(context)
    plant.SetPositions(plant_context, [-1.0, 0.5])
    region = lib.IrisNp(plant, plant_context, lib.IrisOptions(iteration_limit=3, random_seed=3))
    return "IrisNp", region.MaximumVolumeInscribedEllipsoid().CalcVolume()


@program("static equilibrium")
def static_equilibrium(lib: Any, solver: str) -> tuple[str, float]:
    """Two balls on the ground beside a wall, and what holds them; the cost is none."""
    builder = lib.DiagramBuilder()
    plant, _ = lib.AddMultibodyPlantSceneGraph(builder, 0.0)
    friction = lib.CoulombFriction(0.8, 0.8)
    for name, radius in (("large", 0.1), ("small", 0.07)):
        ball = plant.AddRigidBody(name, lib.SpatialInertia.SolidSphereWithMass(1.0, radius))
        plant.RegisterCollisionGeometry(ball, lib.RigidTransform(), lib.Sphere(radius), name, friction)
    for name, place, size in (("ground", [0, 0, -0.5], (2, 2, 1)), ("wall", [0.3, 0, 0], (0.2, 2, 2))):
        X_WG, world = lib.RigidTransform(np.array(place, dtype=float)), plant.world_body()
        plant.RegisterCollisionGeometry(world, X_WG, lib.Box(*size), name, friction)
    plant.Finalize()
    duals = builder.Build().ToAutoDiffXd()
    plant = duals.GetSubsystemByName("plant")
    context = duals.CreateDefaultContext()
    problem = lib.StaticEquilibriumProblem(plant, plant.GetMyContextFromRoot(context), set())
    prog, q = problem.get_mutable_prog(), problem.q_vars()
    for first in (0, 7):
        prog.AddConstraint(lib.UnitQuaternionConstraint(), q[first : first + 4])
    prog.AddBoundingBoxConstraint([0.05, -0.01, 0.09], [0.12, 0.01, 0.11], q[4:7])
    prog.SetInitialGuess(q, [1, 0, 0, 0, 0.1, 0, 0.1, 1, 0, 0, 0, -0.05, 0, 0.07])
    return solved(lib, prog, solver)


def run(title: str, package: str, solver: str, repeat: int) -> None:
    """Runs a program and prints its numbers as JSON."""
    lib = importlib.import_module(f"{package}.all")
    cpu, wall = [], []
    for _ in range(repeat):
        gc.collect()  # as long as some programs take; it should not fall on one by chance
        start = time.process_time(), time.perf_counter()
        ended, cost = PROGRAMS[title](lib, solver)
        cpu.append(time.process_time() - start[0])
        wall.append(time.perf_counter() - start[1])
    print(json.dumps({"cpu": cpu, "wall": wall, "ended": ended, "cost": cost}))


def best(seconds: list[float]) -> float:
    """The shortest time after the first; that one if there is no other."""
    return min(seconds[1:] or seconds)


def environment(folder: str) -> dict[str, str]:
    """That of processes which keep byte code in a folder: an installed library has it, a checkout may not."""
    kept = {name: value for name, value in os.environ.items() if name != "PYTHONDONTWRITEBYTECODE"}
    return {**kept, "PYTHONPYCACHEPREFIX": folder}


def command(title: str, package: str, solver: str, repeat: int) -> list[str]:
    return [sys.executable, __file__, "--run", title, package, "--solver", solver, "--repeat", str(repeat)]


def measured(title: str, package: str, options: argparse.Namespace, env: dict[str, str]) -> dict | str:
    solver = options.solver if package == "sheldrake" else ""
    line = command(title, package, solver, options.repeat)
    try:
        done = subprocess.run(line, capture_output=True, text=True, timeout=LIMIT, env=env)
    except subprocess.TimeoutExpired:
        return f"> {LIMIT:.0f} s"
    return json.loads(done.stdout.splitlines()[-1]) if not done.returncode else done.stderr.strip().splitlines()[-1]


def later_runs(title: str, options: argparse.Namespace, env: dict[str, str]) -> None:
    """Prints what the later runs and the first one take in one process."""
    found = {}
    for package in PACKAGES:
        found[package] = now = measured(title, package, options, env)
        if isinstance(now, str):
            print(f"{title:34s} {package:10s} {now}", flush=True)
            continue
        print(
            f"{title:34s} {package:10s} CPU {best(now['cpu']):7.3f} ({now['cpu'][0]:7.3f}) s  wall "
            f"{best(now['wall']):7.3f} s  cost {now['cost']:<12.8g} {now['ended']}",
            flush=True,
        )
    if all(isinstance(now, dict) for now in found.values()):
        ours, theirs = (found[package]["cpu"] for package in PACKAGES)
        print(f"{'':34s} ours/Drake {best(ours) / best(theirs):.2f} ({ours[0] / theirs[0]:.2f})", flush=True)


def whole_process(line: list[str], env: dict[str, str]) -> tuple[float, float]:
    """CPU time and time on the clock of a process."""
    start = time.perf_counter()
    process = subprocess.Popen(line, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, env=env)
    _, status, used = os.wait4(process.pid, 0)
    process.returncode = os.waitstatus_to_exitcode(status)
    if process.returncode:
        sys.exit(f"{' '.join(line)} ended with {process.returncode}")
    return used.ru_utime + used.ru_stime, time.perf_counter() - start


def whole_processes(title: str, options: argparse.Namespace, env: dict[str, str]) -> None:
    """Prints what processes take that run the program once."""
    lines = {
        package: command(title, package, options.solver if package == "sheldrake" else "", 1) for package in PACKAGES
    }
    for line in lines.values():
        whole_process(line, env)  # writes byte code, and compiles what is not compiled yet
    turns = [{package: whole_process(line, env) for package, line in lines.items()} for _ in range(options.repeat)]
    cpu, wall = ({p: statistics.median([turn[p][k] for turn in turns]) for p in PACKAGES} for k in (0, 1))
    print(
        f"{title:34s} whole process: CPU {cpu['sheldrake']:.2f} s, Drake {cpu['pydrake']:.2f} s; wall "
        f"{wall['sheldrake']:.2f} s, {wall['pydrake']:.2f} s; ours/Drake {cpu['sheldrake'] / cpu['pydrake']:.2f}",
        flush=True,
    )


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--only", nargs="+", default=list(PROGRAMS), metavar="PROGRAM")
    parser.add_argument("--solver", default="", help="name of the solver of nonlinear programs")
    parser.add_argument("--repeat", type=int, default=5)
    parser.add_argument("--whole", action="store_true", help="whole processes, each of which runs a program once")
    parser.add_argument("--run", nargs=2, metavar=("PROGRAM", "PACKAGE"), help=argparse.SUPPRESS)
    options = parser.parse_args()
    if options.run:
        run(*options.run, options.solver, options.repeat)
        return
    print(machine())
    with tempfile.TemporaryDirectory() as folder:
        for title in options.only:
            (whole_processes if options.whole else later_runs)(title, options, environment(folder))


if __name__ == "__main__":
    main()
