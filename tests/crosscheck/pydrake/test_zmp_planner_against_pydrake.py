"""Motions of a center of mass for the same zero-moment points: the same in both libraries."""

import importlib

import numpy as np
import pytest

pytestmark = pytest.mark.peer
pytest.importorskip("pydrake")

TIMES = (-0.5, 0.0, 0.3, 1.0, 1.7, 2.5, 3.0, 5.0)
POINTS = np.array([[0, 0.2, 0.4, 0.4], [0.1, -0.1, 0.1, 0.1]])
X0 = np.array([0.01, 0.02, 0.1, 0.05])


def planned(name, hold, points=POINTS):
    planning, trajectories = (importlib.import_module(f"{name}.{part}") for part in ("planning", "trajectories"))
    planner = planning.ZmpPlanner()
    assert not planner.has_planned()
    make = getattr(trajectories.PiecewisePolynomial, hold)
    planner.Plan(make([0, 1, 2, 3], points), X0, 0.8, Qy=np.diag([1.0, 2.0]))
    return planner


def everything(planner):
    out = [planner.get_A(), planner.get_B(), planner.get_C(), planner.get_D(), planner.get_Qy(), planner.get_R()]
    out += [planner.get_Vxx(), planner.get_final_desired_zmp(), planner.comdd_to_cop([0.1, 0.2, 0.3, 0.4], [1, 2.0])]
    for t in TIMES:
        out += [planner.get_nominal_com(t), planner.get_nominal_comd(t), planner.get_nominal_comdd(t)]
        out += [planner.get_Vx(t), planner.get_desired_zmp(t), planner.ComputeOptimalCoMdd(t, [0.1, 0.2, 0.3, 0.4])]
    return [np.asarray(v) for v in out]


@pytest.mark.parametrize("hold", ["ZeroOrderHold", "FirstOrderHold", "CubicShapePreserving"])
def test_plans(hold):
    for mine, other in zip(everything(planned("sheldrake", hold)), everything(planned("pydrake", hold))):
        np.testing.assert_allclose(mine, other, atol=1e-9)


def test_nothing_is_known_before_the_plan():
    from sheldrake.planning import ZmpPlanner

    with pytest.raises(RuntimeError, match="Plan"):
        ZmpPlanner().get_Vxx()


def test_a_planted_fault_is_seen():
    mine = everything(planned("sheldrake", "FirstOrderHold", 1.01 * POINTS))
    other = everything(planned("pydrake", "FirstOrderHold"))
    assert max(np.abs(a - b).max() for a, b in zip(mine, other)) > 1e-3


@pytest.mark.parametrize("name", ["sheldrake", "pydrake"])
def test_a_state_has_four_numbers(name):
    planner = planned(name, "FirstOrderHold")
    with pytest.raises(TypeError):
        planner.ComputeOptimalCoMdd(0.5, [0.1, 0.2])
    with pytest.raises(TypeError):
        planner.Plan(planner.get_desired_zmp(), [0.1, 0.2, 0.3], 0.8)
    assert planner.get_nominal_com(0.0) == pytest.approx(X0[:2])
