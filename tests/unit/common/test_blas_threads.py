import subprocess
import sys

import numpy as np
import pytest
import scipy.linalg  # noqa: F401  whose library counts once it is loaded

from sheldrake.common._blas import _libraries, one_thread
from sheldrake.solvers import MathematicalProgram, SnoptSolver


def test_linear_algebra_of_scipy_is_not_loaded_to_be_told():
    code = """
import sys
from sheldrake.common._blas import one_thread
with one_thread():
    print("scipy" in sys.modules)
    import scipy.linalg
    from sheldrake.common._blas import _libraries
    before = [library.get() for library in _libraries()]
    with one_thread():
        print(all(library.get() == 1 for library in _libraries()))
print([library.get() for library in _libraries()][1:] == before[1:])
"""
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.split() == ["False", "True", "True"]


def counts():
    return [library.get() for library in _libraries()]


@pytest.fixture
def two_threads():
    before = counts()
    if not before:
        pytest.skip("NumPy and SciPy do not use OpenBLAS here")
    for library in _libraries():
        library.set(2)
    yield
    for library, count in zip(_libraries(), before):
        library.set(count)


@pytest.mark.usefixtures("two_threads")
def test_one_thread_inside_and_as_before_outside():
    with one_thread():
        assert set(counts()) == {1}
        with one_thread():
            assert set(counts()) == {1}
        assert set(counts()) == {1}
    assert set(counts()) == {2}


@pytest.mark.usefixtures("two_threads")
def test_threads_come_back_after_an_error():
    with pytest.raises(ZeroDivisionError), one_thread():
        1 / 0  # noqa: B018
    assert set(counts()) == {2}


@pytest.mark.usefixtures("two_threads")
def test_nonlinear_programs_are_solved_on_one_thread():
    seen = []

    def cost(x):
        seen.extend(counts())
        return x @ x + np.sin(x[0])

    program = MathematicalProgram()
    x = program.NewContinuousVariables(2)
    program.AddCost(cost, vars=x)
    assert SnoptSolver().Solve(program, [1.0, 2.0], None).is_success()
    assert set(seen) == {1}
    assert set(counts()) == {2}


@pytest.mark.usefixtures("two_threads")
def test_the_last_of_several_threads_sets_them_back():
    first, second = one_thread(), one_thread()  # as two threads would, one leaving before the other
    first.__enter__()
    second.__enter__()
    first.__exit__(None, None, None)
    assert set(counts()) == {1}
    second.__exit__(None, None, None)
    assert set(counts()) == {2}
