"""Linear programs of either library with some integers, solved by SciPy alone."""

import numpy as np


def arrays(prog):
    """Rows, bounds and kinds of variables of the linear constraints; cones are left out."""
    from scipy.sparse import csr_matrix

    rows, lower, upper = [], [], []
    for binding in prog.GetAllConstraints():
        e = binding.evaluator()
        if not hasattr(e, "GetDenseA"):
            continue
        A = np.zeros((e.num_constraints(), prog.num_vars()))
        np.add.at(A, (slice(None), prog.FindDecisionVariableIndices(binding.variables())), e.GetDenseA())
        rows.append(A)
        lower.append(e.lower_bound())
        upper.append(e.upper_bound())
    binary = np.array([v.get_type().name == "BINARY" for v in prog.decision_variables()])
    return csr_matrix(np.vstack(rows)), np.concatenate(lower), np.concatenate(upper), binary


def least(prog, places, cost):
    """The least value of a linear cost of the variables at some places."""
    from scipy.optimize import Bounds, LinearConstraint, milp

    A, lower, upper, binary = arrays(prog)
    c = np.zeros(prog.num_vars())
    c[places] = cost
    bounds = Bounds(np.where(binary, 0.0, -np.inf), np.where(binary, 1.0, np.inf))
    found = milp(c, constraints=LinearConstraint(A, lower, upper), bounds=bounds, integrality=binary)
    assert found.success, found.message
    return found.fun
