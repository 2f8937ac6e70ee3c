"""Integrators against what mathematics says: order of convergence, a standard test set, a stiff problem, conserved
energy, and the times of events."""

import functools

import numpy as np
import pytest
from ode_problems import END, PROBLEMS
from scipy.integrate import solve_ivp
from scipy.special import ellipk

from sheldrake.systems.analysis import GetIntegrationSchemes, ResetIntegratorFromFlags, Simulator
from sheldrake.systems.framework import LeafSystem, PublishEvent, WitnessFunctionDirection

ORDERS = {
    "bogacki_shampine3": 3,
    "explicit_euler": 1,
    "implicit_euler": 1,
    "radau1": 1,
    "radau3": 3,
    "runge_kutta2": 2,
    "runge_kutta3": 3,
    "runge_kutta5": 5,
    "semi_explicit_euler": 1,
    "velocity_implicit_euler": 1,
}


class Equation(LeafSystem):
    """x' = f(t, x); half of x are positions if there are velocities."""

    def __init__(self, f, x0, num_velocities=0):
        super().__init__()
        self.f, self.evaluations = f, 0
        n = len(x0)
        self.DeclareContinuousState(np.asarray(x0), num_velocities, num_velocities, n - 2 * num_velocities)

    def DoCalcTimeDerivatives(self, context, derivatives):
        self.evaluations += 1
        x = context.get_continuous_state_vector().CopyToVector()
        derivatives.get_mutable_vector().SetFromVector(self.f(context.get_time(), x))


def simulator_of(system, scheme, step, accuracy=None):
    simulator = Simulator(system)
    integrator = ResetIntegratorFromFlags(simulator, scheme, step)
    if accuracy is not None:
        integrator.set_fixed_step_mode(False)
        integrator.set_target_accuracy(accuracy)
    else:
        integrator.set_fixed_step_mode(True)
    return simulator


def state_at(simulator, t):
    simulator.AdvanceTo(t)
    return simulator.get_context().get_continuous_state_vector().CopyToVector()


def forced_pendulum(t, x):
    return np.array([x[1], -np.sin(x[0]) - 0.5 * x[1] * np.cos(x[0]) + np.cos(3.0 * t)])


@functools.cache
def forced_pendulum_at_one():
    return solve_ivp(forced_pendulum, (0, 1), [0.3, 0.4], method="DOP853", rtol=1e-13, atol=1e-13).y[:, -1]


def errors(scheme, steps, order_fault=0.0):
    """Errors of the forced pendulum after 1 s, in steps of these lengths [s]."""

    def f(t, x):
        return forced_pendulum(t + order_fault, x)

    found = []
    for h in steps:
        x = state_at(simulator_of(Equation(f, [0.3, 0.4], 1), scheme, h), 1.0)
        found.append(np.abs(x - forced_pendulum_at_one()).max())
    return np.array(found)


def slope(scheme, order_fault=0.0):
    steps = np.array([1 / 8, 1 / 16, 1 / 32, 1 / 64]) if ORDERS[scheme] > 1 else np.array([1 / 128, 1 / 256, 1 / 512])
    return np.polyfit(np.log(steps), np.log(errors(scheme, steps, order_fault)), 1)[0]


def test_every_scheme_has_an_order():
    of_plants_only = {"cenic"}
    assert sorted({*GetIntegrationSchemes()} - of_plants_only) == sorted(ORDERS)


@pytest.mark.parametrize("scheme", ORDERS)
def test_order_of_convergence(scheme):
    assert slope(scheme) == pytest.approx(ORDERS[scheme], abs=0.3)


@pytest.mark.parametrize("scheme", ["runge_kutta3", "radau3"])
def test_a_slightly_wrong_equation_has_no_order(scheme):
    assert slope(scheme, order_fault=1e-3) < 1.5


SCIPY = {"runge_kutta3": "RK23", "bogacki_shampine3": "RK23", "runge_kutta5": "RK45"}


@functools.cache
def solution(problem):
    f, x0 = PROBLEMS[problem]
    return solve_ivp(f, (0, END), x0, method="DOP853", rtol=1e-13, atol=1e-13).y[:, -1]


@pytest.mark.parametrize("problem", PROBLEMS)
@pytest.mark.filterwarnings("ignore:.*rtol.*too small")
def test_as_exact_as_scipy_at_the_same_tolerance(problem):
    """Both bound the error of a step; it adds up differently, hence the factors."""
    f, x0 = PROBLEMS[problem]
    for accuracy in (1e-4, 1e-7):
        for scheme, method in SCIPY.items():
            system = Equation(f, x0)
            error = np.abs(state_at(simulator_of(system, scheme, 2.0, accuracy), END) - solution(problem)).max()
            theirs = solve_ivp(f, (0, END), x0, method=method, rtol=3e-14, atol=accuracy, max_step=2.0)
            their_error = np.abs(theirs.y[:, -1] - solution(problem)).max()
            where = (problem, scheme, accuracy)
            assert error < 3.0 * their_error + 4.0 * accuracy, where
            assert system.evaluations < 4.0 * theirs.nfev, where


def van_der_pol(t, x, mu=1000.0):
    return np.array([x[1], mu * (1.0 - x[0] ** 2) * x[1] - x[0]])


@pytest.mark.parametrize(
    ("scheme", "accuracy", "error", "evaluations"),
    [("radau3", 1e-6, 1e-4, 80_000), ("implicit_euler", 1e-4, 1e-2, 100_000)],
)
def test_stiff_oscillator(scheme, accuracy, error, evaluations):
    """Van der Pol's for mu = 1000, past its first jump: an explicit method needs more than a million steps."""
    system = Equation(van_der_pol, [2.0, 0.0], 1)
    x = state_at(simulator_of(system, scheme, 100.0, accuracy), 1200.0)
    exact = solve_ivp(van_der_pol, (0, 1200), [2.0, 0.0], method="Radau", rtol=1e-10, atol=1e-12).y[:, -1]
    assert exact[0] < -1.5, "it has jumped"
    assert abs(x[0] - exact[0]) < error
    assert system.evaluations < evaluations


def kepler(t, x):
    return np.concatenate([x[2:], -x[:2] / np.hypot(*x[:2]) ** 3])


def kepler_energy(x):
    return 0.5 * x[2:] @ x[2:] - 1.0 / np.hypot(*x[:2])


def energies(scheme, step, stops, accuracy=None):
    simulator = simulator_of(Equation(kepler, PROBLEMS["D2"][1], 2), scheme, step, accuracy)
    return np.array([kepler_energy(state_at(simulator, t)) for t in stops])


def test_energy_of_an_orbit():
    """100 revolutions (e = 0.3). Semi-explicit Euler is symplectic: its energy swings but does not drift."""
    start = kepler_energy(PROBLEMS["D2"][1])
    exact = energies("runge_kutta5", 1.0, [628.0], 1e-12)
    assert abs(exact[0] - start) < 1e-8
    swings = np.abs(energies("semi_explicit_euler", 0.02, np.linspace(6.0, 628.0, 400)) - start)
    assert swings.max() < 0.02
    assert swings[200:].max() < 1.1 * swings[:200].max()
    assert energies("explicit_euler", 0.02, [628.0])[0] - start > 0.1, "explicit Euler gains energy"


class Watched(Equation):
    """Notes when its first coordinate becomes negative."""

    def __init__(self, f, x0):
        super().__init__(f, x0, 1)
        event = PublishEvent(system_callback=lambda system, context, event: self.times.append(context.get_time()))
        direction = WitnessFunctionDirection.kPositiveThenNonPositive
        self.witness = self.MakeWitnessFunction("negative", direction, self.height, event)
        self.times = []

    def height(self, context):
        return context.get_continuous_state_vector()[0]

    def DoGetWitnessFunctions(self, context):
        return [self.witness]


def event_time(f, x0, until, accuracy=1e-10):
    system = Watched(f, x0)
    simulator = simulator_of(system, "runge_kutta5", 0.1, 1e-14)
    simulator.get_mutable_context().SetAccuracy(accuracy)
    simulator.AdvanceTo(until)
    (time,) = system.times
    return time


def test_a_ball_touches_the_ground_when_it_does():
    time = event_time(lambda t, x: np.array([x[1], -9.81]), [1.0, 0.0], 0.6)
    assert abs(time - np.sqrt(2 / 9.81)) < 1e-12
    assert abs(event_time(lambda t, x: np.array([x[1], -9.81]), [1.0, 0.0], 0.6, 1e-8) - time) > 1e-12


def test_a_pendulum_is_upright_after_a_quarter_of_its_period():
    """sqrt(L / g) K(sin(theta0 / 2)), with K the complete elliptic integral of the first kind."""
    time = event_time(lambda t, x: np.array([x[1], -9.81 * np.sin(x[0])]), [1.0, 0.0], 1.0)
    assert abs(time - ellipk(np.sin(0.5) ** 2) / np.sqrt(9.81)) < 1e-12
