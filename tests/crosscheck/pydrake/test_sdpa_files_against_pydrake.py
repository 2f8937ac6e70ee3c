"""Files of semidefinite programs: the same problem, number by number."""

import importlib

import numpy as np
import pytest

pytestmark = pytest.mark.peer
pytest.importorskip("pydrake")

METHODS = ("kNullspace", "kTwoSlackVariables", "kLorentzConeSlack")
PROGRAMS = {}


def program(build):
    PROGRAMS[build.__name__] = build
    return build


@program
def matrix(p):
    X = p.NewSymmetricContinuousVariables(2)
    p.AddPositiveSemidefiniteConstraint(X)
    p.AddLinearCost(2 * X[0, 0] + 3 * X[0, 1] + 4 * X[1, 1] + 7)
    p.AddLinearEqualityConstraint(X[0, 0] + X[1, 1] == 1)
    p.AddLinearConstraint(X[0, 1] <= 0.3)


@program
def free_variables(p):
    X = p.NewSymmetricContinuousVariables(2)
    s = p.NewContinuousVariables(2)
    p.AddPositiveSemidefiniteConstraint(X)
    p.AddLinearCost(2 * X[0, 0] + 3 * X[1, 1] + s[0] - 2 * s[1])
    p.AddLinearEqualityConstraint(np.array([[1.0, 1, 2], [0, 1, 1]]), np.array([1.0, 2]), np.array([X[0, 0], *s]))
    p.AddLinearEqualityConstraint(X[1, 1] + X[0, 1] - s[0] == 3)


@program
def bounds(p):
    x = p.NewContinuousVariables(5)
    p.AddBoundingBoxConstraint([0, -1, -np.inf, 2, -np.inf], [np.inf, 3, 4, 2, np.inf], x)
    p.AddLinearCost(np.arange(5.0) + 1, 0, x)
    A = np.array([[1.0, 2, 3, 4, 5], [0, 1, 0, -1, 1]])
    p.AddLinearConstraint(A, np.array([-1.0, -2]), np.array([10, np.inf]), x)


@program
def matrix_inequality(p):
    x = p.NewContinuousVariables(2)
    p.AddLinearMatrixInequalityConstraint([np.eye(2), np.array([[0, 1.0], [1, 0]]), np.diag([1.0, 2])], x)
    p.AddLinearCost(x[0] + x[1])


@program
def cones(p):
    x = p.NewContinuousVariables(3)
    p.AddLorentzConeConstraint(np.diag([1.0, 1, 2]), np.array([1.0, 2, 3]), x)
    A = np.array([[1.0, 0, 1], [0, 1, 0], [0, 0, 2], [1, 1, 0]])
    p.AddRotatedLorentzConeConstraint(A, np.array([1.0, 2, 3, 4]), x)
    p.AddLinearCost(x[0] + x[1] + x[2])


@program
def shared_elements(p):
    X = p.NewSymmetricContinuousVariables(3)
    p.AddPositiveSemidefiniteConstraint(X)
    p.AddPositiveSemidefiniteConstraint(X[:2, :2])
    p.AddLinearCost(X[0, 0] + X[1, 2])
    p.AddLinearEqualityConstraint(X[2, 2] == 1)
    p.AddBoundingBoxConstraint(0, 5, X[0, 1])
    p.AddLinearEqualityConstraint(X[0, 0] + X[1, 1] == 2)


@program
def everything(p):
    x = p.NewContinuousVariables(3, "x")
    X = p.NewSymmetricContinuousVariables(2, "X")
    p.AddBoundingBoxConstraint([0, 0, 0], [2, np.inf, np.inf], x)
    p.AddRotatedLorentzConeConstraint(np.array([[1.0, 0, 1], [0, 1, 0], [0, 0, 2]]), np.array([1.0, 2, 3]), x)
    p.AddLinearMatrixInequalityConstraint([np.eye(3), np.ones((3, 3)), np.diag([1.0, 2, 5])], x[:2])
    p.AddLorentzConeConstraint(np.array([[1.0, 0, 0], [0, 1, 0]]), np.array([1.0, 2]), x)
    p.AddLinearConstraint(x[0] + x[1] + X[0, 1] <= 5)
    p.AddLinearEqualityConstraint(X[0, 0] + x[2] == 3)
    p.AddPositiveSemidefiniteConstraint(X)
    p.AddLinearCost(x[0] + X[1, 1])
    p.AddLinearCost(x[0] - x[1])


@program
def one_variable(p):
    x = p.NewContinuousVariables(1)
    p.AddLinearCost(x[0] + 5)
    p.AddBoundingBoxConstraint(1, np.inf, x)
    p.AddBoundingBoxConstraint(0, 3, x)


def written(name, build, method, path, change=None):
    """The blocks, right-hand sides and matrices, as vectors of all their elements, of the file that is written."""
    s = importlib.import_module(f"{name}.solvers")
    prog = s.MathematicalProgram()
    build(prog)
    if change is not None:
        change(prog)
    assert s.GenerateSDPA(prog, str(path / name), getattr(s.RemoveFreeVariableMethod, method))
    lines = (path / f"{name}.dat-s").read_text().split("\n")
    blocks = [int(word) for word in lines[2].split()]
    assert int(lines[1]) == len(blocks)
    g = np.array([float(word) for word in lines[3].split()])
    starts = np.concatenate(([0], np.cumsum([b * b for b in blocks])))
    matrices = np.zeros((int(lines[0]) + 1, starts[-1]))
    for line in filter(None, lines[4:]):
        number, block, i, j = (int(word) for word in line.split()[:4])
        matrices[number, starts[block - 1] + (i - 1) * abs(blocks[block - 1]) + j - 1] = float(line.split()[4])
    return blocks, g, matrices


def table(g, matrices):
    return sorted(map(tuple, np.column_stack((np.round(g, 12), np.round(matrices[1:], 12))) + 0.0))


@pytest.mark.parametrize("method", METHODS[1:])
@pytest.mark.parametrize("name", PROGRAMS)
def test_files_are_pydrakes(name, method, tmp_path):
    ours, theirs = (written(lib, PROGRAMS[name], method, tmp_path) for lib in ("sheldrake", "pydrake"))
    assert ours[0] == theirs[0]
    np.testing.assert_allclose(ours[2][0], theirs[2][0], atol=1e-14)
    np.testing.assert_allclose(table(*ours[1:]), table(*theirs[1:]), atol=1e-12)


def rank(*rows):
    return np.linalg.matrix_rank(np.vstack(rows), tol=1e-9)


@pytest.mark.parametrize("name", PROGRAMS)
def test_nullspaces_are_pydrakes(name, tmp_path):
    """Equations are combined with another basis of the same space; costs differ by such combinations."""
    ours, theirs = (written(lib, PROGRAMS[name], "kNullspace", tmp_path) for lib in ("sheldrake", "pydrake"))
    assert ours[0] == theirs[0] and len(ours[1]) == len(theirs[1])
    a, b = (np.column_stack((f[1], f[2][1:])) for f in (ours, theirs))
    assert rank(a, b) == rank(a) == rank(b)
    assert rank(ours[2][1:], ours[2][0] - theirs[2][0]) == rank(ours[2][1:])


def test_a_planted_fault_is_caught(tmp_path):
    def change(prog):
        prog.AddLinearEqualityConstraint(prog.decision_variables()[0] == 0.999)

    ours = written("sheldrake", PROGRAMS["matrix"], "kNullspace", tmp_path, change)
    theirs = written("pydrake", PROGRAMS["matrix"], "kNullspace", tmp_path)
    assert table(*ours[1:]) != table(*theirs[1:])
