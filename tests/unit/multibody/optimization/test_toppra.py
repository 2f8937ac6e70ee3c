import numpy as np
import pytest
from scipy.optimize import linprog

from sheldrake.multibody.optimization import CalcGridPointsOptions, Toppra
from sheldrake.multibody.optimization._kernels import toppra
from sheldrake.multibody.plant import MultibodyPlant
from sheldrake.multibody.tree import PrismaticJoint, SpatialInertia
from sheldrake.trajectories import PiecewisePolynomial


def slider():
    plant = MultibodyPlant(0.0)
    body = plant.AddRigidBody("body", SpatialInertia.SolidBoxWithMass(2.0, 0.1, 0.1, 0.1))
    plant.AddJoint(PrismaticJoint("x", plant.world_frame(), body.body_frame(), [1.0, 0.0, 0.0]))
    plant.Finalize()
    return plant


@pytest.mark.parametrize("limit", ["acceleration", "torque"])
def test_a_straight_way_is_halved_between_speeding_up_and_slowing_down(limit):
    """One metre at 4 m/s^2, or 8 N on 2 kg: twice sqrt(2 * 0.5 / 4) s."""
    path = PiecewisePolynomial.FirstOrderHold([0.0, 1.0], [[0.0, 1.0]])
    solver = Toppra(path, slider(), np.linspace(0.0, 1.0, 201))
    if limit == "acceleration":
        solver.AddJointAccelerationLimit([-4.0], [4.0])
    else:
        solver.AddJointTorqueLimit([-8.0], [8.0])
    times = solver.SolvePathParameterization()
    assert times.end_time() == pytest.approx(1.0, abs=1e-9)
    assert times.value(0.5).item() == pytest.approx(0.5, abs=1e-9)
    assert times.EvalDerivative(0.5).item() == pytest.approx(2.0, abs=1e-9)


def test_speed_at_the_end_beyond_what_can_be_reached(caplog):
    path = PiecewisePolynomial.FirstOrderHold([0.0, 1.0], [[0.0, 1.0]])
    solver = Toppra(path, slider(), Toppra.CalcGridPoints(path, CalcGridPointsOptions()))
    solver.AddJointAccelerationLimit([-4.0], [4.0])
    assert solver.SolvePathParameterization(0.0, 3.0) is None  # sqrt(2 * 4 * 1) = 2.83
    assert "not in the controllable set" in caplog.text


@pytest.mark.parametrize("seed", range(30))
def test_ranges_are_those_of_linear_programs(seed):
    rng = np.random.default_rng(seed)
    rows = rng.normal(size=(7, 3))
    rows[rng.random(7) < 0.3, 0] = 0.0
    rows[:, :2] /= np.linalg.norm(rows[:, :2], axis=1)[:, None]
    box = np.array([[0.0, 1.0, 5.0], [0.0, -1.0, 3.0], [1.0, 0.0, 9.0], [-1.0, 0.0, 9.0]])
    rows = np.concatenate((rows, box))
    found, low, high = toppra.range_of_x(rows, 0, len(rows))
    ends = [
        linprog([0.0, sign], A_ub=rows[:, :2], b_ub=rows[:, 2], bounds=(None, None), method="highs")
        for sign in (1.0, -1.0)
    ]
    assert found == (ends[0].status == 0)
    if found:
        assert (low, high) == pytest.approx((ends[0].fun, -ends[1].fun), abs=1e-9)
        x = 0.5 * (low + high)
        found, _, most = toppra.range_of_u(rows, 0, len(rows), x)
        u = linprog([-1.0], A_ub=rows[:, :1], b_ub=rows[:, 2] - rows[:, 1] * x, bounds=(None, None), method="highs")
        assert found and most == pytest.approx(-u.fun, abs=1e-9)


def test_limits_hold_at_the_last_gridpoint_too():
    """q'' = q' u + q_ss s'^2 at both ends of each interval, u = s'' in between; Drake leaves the last end out."""
    path = PiecewisePolynomial.LagrangeInterpolatingPolynomial([0.0, 0.5, 1.0], [[0.0, 0.3, 1.0]])
    grid = np.linspace(0.0, 1.0, 9)
    solver = Toppra(path, slider(), grid)
    solver.AddJointVelocityLimit([-1.0], [1.0])
    solver.AddJointAccelerationLimit([-1.0], [1.0])
    times = solver.SolvePathParameterization()
    x = np.array([times.EvalDerivative(t).item() ** 2 for t in times.get_segment_times()])
    u = np.diff(x) / (2.0 * np.diff(grid))
    q_s, q_ss = (np.array([path.EvalDerivative(s, order).item() for s in grid]) for order in (1, 2))
    for here in (slice(None, -1), slice(1, None)):
        assert np.abs(q_s[here] * u + q_ss[here] * x[here]).max() <= 1.0 + 1e-7
