"""What a program loads takes longer than the program."""

import subprocess
import sys


def test_a_kinematic_trajectory_is_found_without_scipys_matrices():
    program = """
import sys
import numpy as np
from sheldrake.planning import KinematicTrajectoryOptimization
from sheldrake.solvers import SnoptSolver
trajopt = KinematicTrajectoryOptimization(2, 10)
trajopt.AddDurationCost(1.0)
trajopt.AddDurationConstraint(0.5, 5.0)
trajopt.AddVelocityBounds(np.full(2, -2.0), np.full(2, 2.0))
for s in (0.0, 1.0):
    trajopt.AddPathPositionConstraint(np.full(2, s), np.full(2, s), s)
result = SnoptSolver().Solve(trajopt.prog())
assert result.is_success() and abs(result.get_optimal_cost() - 0.5) < 1e-6, result.get_optimal_cost()
assert not {"scipy.linalg", "scipy.sparse", "scipy.optimize"} & set(sys.modules)
"""
    subprocess.run([sys.executable, "-c", program], check=True, timeout=120)
