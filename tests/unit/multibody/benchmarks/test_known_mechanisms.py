"""The mass on a spring and the acrobot."""

import numpy as np
import pytest

from sheldrake.geometry import SceneGraph
from sheldrake.multibody.benchmarks import MassDamperSpringAnalyticalSolution
from sheldrake.multibody.benchmarks.acrobot import AcrobotParameters, MakeAcrobotPlant


@pytest.mark.parametrize("b", [0.0, 0.3, 4.0, 9.0], ids=["undamped", "swings", "critical", "creeps"])
def test_the_solution_solves_its_equation(b):
    m, k, h = 2.0, 2.0, 1e-4
    solution = MassDamperSpringAnalyticalSolution(m, b, k)
    solution.SetInitialValue(0.7, -0.4)
    assert (solution.get_x(0.0), solution.get_xDt(0.0)) == pytest.approx((0.7, -0.4), rel=1e-15)
    for t in (0.0, 0.5, 3.0):
        x, v, a = solution.get_x(t), solution.get_xDt(t), solution.get_xDtDt(t)
        assert m * a + b * v + k * x == pytest.approx(0.0, abs=1e-15)
        slope = (solution.get_x(t + h) - solution.get_x(t - h)) / (2 * h)  # off by h²/6 x''' < 1e-8
        assert slope == pytest.approx(v, abs=1e-8)
    assert abs(solution.get_x(2000.0)) < (1.0 if b == 0.0 else 1e-30)


def test_a_mass_of_zero_is_refused():
    with pytest.raises(RuntimeError, match="mass"):
        MassDamperSpringAnalyticalSolution(0.0, 1.0, 1.0)


def test_the_acrobot_keeps_its_energy_and_is_drawn():
    plant = MakeAcrobotPlant(AcrobotParameters(), True)
    assert [plant.num_positions(), plant.num_actuators(), plant.num_frames()] == [2, 1, 4]
    context = plant.CreateDefaultContext()
    plant.SetPositionsAndVelocities(context, [0.3, -0.5, 0.2, 0.1])
    plant.get_actuation_input_port().FixValue(context, [0.7])
    v, vdot = plant.GetVelocities(context), plant.EvalTimeDerivatives(context).CopyToVector()[2:]
    # The power of the motor is the rate of the energy.
    M = plant.CalcMassMatrix(context)
    rest = M @ vdot + plant.CalcBiasTerm(context) - plant.CalcGravityGeneralizedForces(context)
    np.testing.assert_allclose(v @ rest, 0.7 * v[1], rtol=1e-13)
    scene_graph = SceneGraph()
    drawn = MakeAcrobotPlant(default_parameters=AcrobotParameters(), finalize=False, scene_graph=scene_graph)
    assert not drawn.is_finalized()
    assert scene_graph.model_inspector().num_geometries() == 3
