"""Mathematical programs that both libraries build: `build(solvers, symbolic) -> (prog, tolerance of x)`."""

import numpy as np

PROGRAMS = {}


def program(build):
    PROGRAMS[build.__name__] = build
    return build


@program
def lp(s, sym):
    p = s.MathematicalProgram()
    x = p.NewContinuousVariables(3, "x")
    p.AddLinearCost(-x[0] - 2 * x[1] + 0.5 * x[2] + 3)
    p.AddBoundingBoxConstraint(0, 4, x)
    p.AddLinearConstraint(x[0] + x[1] <= 5)
    p.AddLinearConstraint(np.array([[1, 0, -1.0]]), [-1], [1], x)
    p.AddLinearEqualityConstraint(x[1] - x[2] == 1.5)
    return p, 1e-6


@program
def lp_infeasible(s, sym):
    p = s.MathematicalProgram()
    x = p.NewContinuousVariables(2, "x")
    p.AddCost(x[0])
    p.AddConstraint(x[0] + x[1] <= 1)
    p.AddConstraint(x[0] + x[1] >= 2)
    return p, None


@program
def lp_unbounded(s, sym):
    p = s.MathematicalProgram()
    x = p.NewContinuousVariables(2, "x")
    p.AddCost(x[0] - x[1])
    p.AddConstraint(x[0] >= 1)
    return p, None


@program
def equations(s, sym):
    p = s.MathematicalProgram()
    x = p.NewContinuousVariables(3, "x")
    p.AddLinearEqualityConstraint(np.array([[1, 2, 0], [0, 1, 1.0]]), [3, 4], x)
    p.AddConstraint(x[0] == 3 * x[2])
    return p, 1e-9


@program
def equality_qp(s, sym):
    p = s.MathematicalProgram()
    x = p.NewContinuousVariables(3, "x")
    p.AddQuadraticCost((x[0] - 1) ** 2 + 2 * (x[1] + x[2]) ** 2 + x[2] ** 2 + x[0])
    p.AddLinearConstraint(x[0] + x[1] == 2)
    return p, 1e-9


@program
def qp(s, sym):
    p = s.MathematicalProgram()
    x = p.NewContinuousVariables(4, "x")
    Q = np.diag([1.0, 2, 3, 4]) + 0.5
    p.AddQuadraticCost(Q, np.array([1.0, -2, 3, -4]), 0.5, x)
    p.AddQuadraticErrorCost(2 * np.eye(2), [1, 2], x[:2])
    p.Add2NormSquaredCost(np.array([[1, 2.0], [0, 1]]), [1, 1], x[2:])
    p.AddLinearConstraint(x.sum(), 0.5, 0.75)
    p.AddBoundingBoxConstraint([-0.1, -0.1], [0.2, 0.2], x[1:3])
    return p, 1e-6


@program
def socp(s, sym):
    p = s.MathematicalProgram()
    x = p.NewContinuousVariables(3, "x")
    p.AddLinearCost(x[0] + x[1] - 2 * x[2])
    p.AddLorentzConeConstraint(np.array([2 - x[0], x[1] + 1, 2 * x[2]]))
    p.AddRotatedLorentzConeConstraint(np.array([x[0] + 3, 1 + x[2], x[1] - x[2]]))
    p.AddBoundingBoxConstraint(-1, 5, x[0])
    return p, 1e-6


@program
def lorentz_from_symbols(s, sym):
    p = s.MathematicalProgram()
    x = p.NewContinuousVariables(2, "x")
    p.AddLinearCost(-x[0] - x[1])
    p.AddConstraint(sym.sqrt(x[0] ** 2 + 2 * x[1] ** 2 + x[0] * x[1] + 1) <= 3 - x[0])
    p.AddLorentzConeConstraint(linear_expression=x[0] + 4, quadratic_expression=x[0] ** 2 + (x[1] - 1) ** 2)
    p.AddQuadraticAsRotatedLorentzConeConstraint(np.diag([2.0, 1.0]), np.array([1.0, 0]), -7.0, x)
    return p, 1e-5


@program
def l2norm(s, sym):
    p = s.MathematicalProgram()
    x = p.NewContinuousVariables(2, "x")
    p.AddL2NormCost(np.array([[1, 2.0], [0, 1], [1, 1]]), np.array([1, 2.0, 3]), x)
    p.AddLinearConstraint(x[0] >= -1)
    return p, 1e-6


@program
def l1_epigraph(s, sym):
    p = s.MathematicalProgram()
    x = p.NewContinuousVariables(2, "x")
    p.AddL1NormCostInEpigraphForm(np.array([[1, 2.0], [0, 1], [1, -1]]), np.array([1, 2.0, 3]), x)
    return p, 1e-6


@program
def sdp(s, sym):
    p = s.MathematicalProgram()
    X = p.NewSymmetricContinuousVariables(3, "X")
    p.AddLinearCost(X[0, 0] + 2 * X[1, 1] + 3 * X[2, 2] - X[0, 1])
    p.AddPositiveSemidefiniteConstraint(X)
    p.AddLinearConstraint(X[0, 1] + X[1, 2] == 1)
    p.AddLinearConstraint(X[0, 2] >= 0.5)
    return p, 1e-5


@program
def lmi(s, sym):
    p = s.MathematicalProgram()
    x = p.NewContinuousVariables(2, "x")
    p.AddLinearCost(x[0] + x[1])
    p.AddLinearMatrixInequalityConstraint(np.array([[x[0], 1 + x[1]], [1 + x[1], 2 + x[1]]]))
    p.AddPositiveSemidefiniteConstraint(np.array([[x[0] + 1, x[1]], [x[1], 2 - x[0]]]))
    p.AddLinearMatrixInequalityConstraint([np.eye(2), np.diag([1.0, 0])], x[:1])
    return p, 1e-5


@program
def exponential_cone(s, sym):
    p = s.MathematicalProgram()
    x = p.NewContinuousVariables(3, "x")
    p.AddLinearCost(x[0])
    p.AddExponentialConeConstraint(np.array([x[0], 1 + 0 * x[0], x[1]]))
    p.AddLinearConstraint(x[1] + x[2] == 2)
    p.AddBoundingBoxConstraint(-1, 0.5, x[2])
    return p, 1e-5


@program
def log_determinant(s, sym):
    p = s.MathematicalProgram()
    X = p.NewSymmetricContinuousVariables(2, "X")
    p.AddMaximizeLogDeterminantCost(X)
    p.AddLinearConstraint(X[0, 0] + X[1, 1] + X[0, 1] <= 2)
    return p, 1e-4


@program
def geometric_mean(s, sym):
    p = s.MathematicalProgram()
    x = p.NewContinuousVariables(3, "x")
    p.AddMaximizeGeometricMeanCost(np.eye(3), np.array([0, 1.0, 0]), x)
    p.AddBoundingBoxConstraint(0, 4, x)
    p.AddLinearConstraint(x.sum() <= 5)
    return p, 1e-5


@program
def lcp(s, sym):
    p = s.MathematicalProgram()
    x = p.NewContinuousVariables(4, "x")
    M = np.array([[1, 4, 2, -1], [3, 4, 0, -4], [-2, -2, -1, 1], [2, 1, 6, 2.0]])
    p.AddLinearComplementarityConstraint(M @ M.T + np.eye(4), [-1, 2, -3, -4], x)
    return p, 1e-8


@program
def nlp(s, sym):
    p = s.MathematicalProgram()
    x = p.NewContinuousVariables(4, "x")
    p.AddCost(x[0] * x[3] * (x[0] + x[1] + x[2]) + x[2])
    p.AddConstraint(x[0] * x[1] * x[2] * x[3] >= 25)
    p.AddConstraint(x.dot(x) == 40)
    p.AddBoundingBoxConstraint(1, 5, x)
    p.SetInitialGuess(x, [1, 5, 5, 1])
    return p, 1e-4


@program
def nlp_functions(s, sym):
    p = s.MathematicalProgram()
    x = p.NewContinuousVariables(2, "x")
    p.AddCost(lambda z: np.exp(z[0]) + (z[1] - z[0]) ** 2, vars=x, description="mine")
    p.AddConstraint(lambda z: np.array([z[0] + np.sin(z[1]), z[0] * z[1]]), lb=[-1, 0.2], ub=[2, 3], vars=x)
    p.AddConstraint(sym.cos(x[0]) + x[1] <= 2)
    p.SetInitialGuess(x, [1, 1])
    return p, 1e-4


@program
def rosenbrock(s, sym):
    p = s.MathematicalProgram()
    x = p.NewContinuousVariables(2, "x")
    p.AddCost((1 - x[0]) ** 2 + 100 * (x[1] - x[0] ** 2) ** 2)
    p.AddConstraint(x.dot(x) <= 1.5)
    p.SetInitialGuess(x, [-1, 1])
    return p, 1e-4


@program
def nonconvex_quadratic(s, sym):
    p = s.MathematicalProgram()
    x = p.NewContinuousVariables(2, "x")
    p.AddQuadraticCost(x[0] * x[1] + 0.5 * x[0] - x[1] ** 2)
    p.AddBoundingBoxConstraint(-1, 2, x)
    p.SetInitialGuess(x, [0.5, -0.2])
    return p, 1e-5


@program
def sum_of_squares(s, sym):
    p = s.MathematicalProgram()
    x = p.NewIndeterminates(2, "x")
    c = p.NewContinuousVariables(1, "c")
    f = 4 * x[0] ** 2 - 2.1 * x[0] ** 4 + x[0] ** 6 / 3 + x[0] * x[1] - 4 * x[1] ** 2 + 4 * x[1] ** 4
    p.AddSosConstraint(f - c[0])
    p.AddLinearCost(-c[0])
    return p, None


@program
def lyapunov(s, sym):
    p = s.MathematicalProgram()
    x = p.NewIndeterminates(2, "x")
    V = p.NewSosPolynomial(sym.Variables(x), 2)[0].ToExpression()
    Vdot = V.Jacobian(x).dot([-x[0] - 2 * x[1] ** 2, -x[1] - x[0] * x[1] - 2 * x[1] ** 3])
    p.AddSosConstraint(V - 0.1 * x.dot(x))
    p.AddSosConstraint(-Vdot - 0.1 * x.dot(x))
    p.AddLinearCost(p.decision_variables()[0] + p.decision_variables()[2])
    return p, None


@program
def diagonally_dominant(s, sym):
    p = s.MathematicalProgram()
    X = p.NewSymmetricContinuousVariables(3, "X")
    Z = p.NewSymmetricContinuousVariables(3, "Z")
    p.AddPositiveDiagonallyDominantMatrixConstraint(X)
    p.AddScaledDiagonallyDominantMatrixConstraint(Z)
    p.AddLinearCost(X[0, 0] + X[1, 1] + X[2, 2] + Z[0, 0] + 2 * Z[1, 1] + Z[2, 2])
    for M in (X, Z):
        p.AddLinearEqualityConstraint(np.array([M[0, 1], M[0, 2], M[1, 2]]), [1, -2, 0.5])
    return p, None
