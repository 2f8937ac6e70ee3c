"""Plots of runs that come to rest: the motion large, the rest in a strip."""

import matplotlib
import numpy as np
import pytest

matplotlib.use("Agg")
import matplotlib.pyplot as plt

from sheldrake.systems.primitives import VectorLog
from sheldrake.visualization import PlotLog


def figure_of(seconds, motion):
    """A log of two numbers: one falls to zero within some seconds, the other is nothing but noise."""
    log, rng = VectorLog(2), np.random.default_rng(1)
    for t in np.linspace(0.0, seconds, 1001):
        log.AddData(t, [max(0.0, 1.0 - t / motion), 1e-17 * rng.normal()])
    return PlotLog(log)


@pytest.fixture(autouse=True)
def close():
    yield
    plt.close("all")


def test_motion_that_ends_early_has_most_of_the_width():
    motion, rest = figure_of(15.0, 0.5).axes
    assert motion.get_xlim()[1] == pytest.approx(0.75, abs=0.05) and rest.get_xlim()[1] == 15.0
    assert motion.get_xlim()[1] == rest.get_xlim()[0] and motion.get_ylim() == rest.get_ylim()
    widths = [ax.get_subplotspec().get_gridspec().get_width_ratios() for ax in (motion, rest)]
    assert widths[0] == widths[1] and widths[0][0] > 5 * widths[0][1]


@pytest.mark.parametrize("motion", [5.0, 15.0])
def test_motion_that_goes_on_is_shown_whole(motion):
    (ax,) = figure_of(15.0, motion).axes
    assert ax.get_xlim()[1] > 15.0


def test_what_never_moves_is_shown_whole():
    log = VectorLog(1)
    for t in (0.0, 1.0, 2.0):
        log.AddData(t, [3.0])
    assert len(PlotLog(log).axes) == 1
