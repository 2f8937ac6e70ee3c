"""The main scene: Drake's numbers where Drake defines them, and rest where Drake never rests."""

from __future__ import annotations

import hashlib

import numpy as np
import pytest
from tests.scenes.scene import SLIDER, drop, library, trajectory

import sheldrake
from sheldrake.common.eigen_geometry import Quaternion

OWN_BLOCK = sheldrake.model_path("two_hole_block/two_hole_block.urdf")
APPROXIMATIONS = ("kLagged", "kSimilar", "kSap", "kTamsi")
ours = library("sheldrake")
needs_slider = pytest.mark.skipif(
    not SLIDER.exists(), reason="the article's own URDF and OBJ are not part of the project"
)


@pytest.mark.peer
@needs_slider
@pytest.mark.parametrize("approximation", APPROXIMATIONS)
def test_article_block_equals_drake(approximation):
    pytest.importorskip("pydrake", reason="compares with an installed drake wheel")
    drake = library("pydrake")
    times, x = trajectory(ours, str(SLIDER), 3.0, approximation=approximation, algorithm="single_point")
    drake_times, y = trajectory(drake, str(SLIDER), 3.0, approximation=approximation)
    np.testing.assert_array_equal(times, drake_times)
    error = np.abs(x[:7] - y[:7]).max(0)
    first_touch = np.argmax(np.abs(np.diff(x[12])) > 0.02)  # gravity alone changes vz by 0.0098 m/s a step
    assert 100 < first_touch < 200
    assert error[: first_touch + 20].max() < 1e-9
    assert error.max() < 1e-6


@pytest.mark.peer
@needs_slider
def test_the_comparison_sees_a_slightly_wrong_scene():
    """A friction off by 1e-4 and a pose off by 1e-8 rad are caught by the same tolerances."""
    pytest.importorskip("pydrake", reason="compares with an installed drake wheel")
    _, y = trajectory(library("pydrake"), str(SLIDER), 3.0)
    _, x = trajectory(ours, str(SLIDER), 3.0, rpy=(0.3 + 1e-8, 0.2, 0.1), algorithm="single_point")
    assert np.abs(x[:7] - y[:7]).max(0)[:150].max() > 1e-9


@pytest.mark.parametrize("approximation", APPROXIMATIONS)
@pytest.mark.parametrize(
    "rpy", [(0.3, 0.2, 0.1), (1.4, 0.1, 0.0), (0.0, 0.0, 0.0), (2.0, -0.7, 0.4), (2.07, -0.65, 0.0)]
)
def test_own_block_comes_to_rest_on_a_face(rpy, approximation):
    times, x = trajectory(ours, OWN_BLOCK, 15.0, rpy=rpy, approximation=approximation)
    assert len(times) == 15001
    last = x[:, times > 10.0]
    assert np.abs(last[7:10]).max() < 1e-9, "angular velocity [rad/s]"
    assert np.abs(last[10:13]).max() < 1e-9, "velocity [m/s]"
    up = ours.RotationMatrix(Quaternion(x[:4, -1] / np.linalg.norm(x[:4, -1]))).matrix()[2]
    assert np.abs(up).max() > 1.0 - 1e-6, "a face of the block is level"


def test_same_bits_in_every_run_and_after_a_clone():
    def state(simulator):
        return simulator.get_context().get_discrete_state_vector().CopyToVector()

    def digest(**options):
        _, x = trajectory(ours, OWN_BLOCK, 1.0, **options)
        return hashlib.sha256(x.tobytes()).hexdigest()

    assert digest() == digest()
    simulator, *_ = drop(ours, OWN_BLOCK)
    simulator.AdvanceTo(0.2)
    other = ours.Simulator(simulator.get_system(), simulator.get_context().Clone())
    other.Initialize()
    for s in (simulator, other):
        s.AdvanceTo(0.4)
    np.testing.assert_array_equal(state(simulator), state(other))


def test_log_is_what_the_article_reads():
    simulator, sink, plant, model = drop(ours, OWN_BLOCK)
    simulator.AdvanceTo(0.25)
    log = sink.FindLog(simulator.get_context())
    assert sink.get_name() == "state logger"
    assert log.sample_times().shape == (251,)
    assert log.data().shape == (13, 251)
    np.testing.assert_array_equal(log.sample_times(), 1e-3 * np.arange(251))
    assert plant.num_multibody_states(model) == 13
    assert log.names() == plant.GetStateNames(model)
    assert log.names()[:5] == ["body_qw", "body_qx", "body_qy", "body_qz", "body_x"]
    np.testing.assert_array_equal(
        log.data()[:, -1], plant.GetPositionsAndVelocities(plant.GetMyContextFromRoot(simulator.get_context()), model)
    )


def test_a_viewer_adds_its_publish_times_to_the_log_as_in_drake():
    """Each of the viewer's 64 publishes a second is the end of a step; a forced publish adds one sample more."""
    from sheldrake.geometry import Meshcat

    simulator, sink, *_ = drop(ours, OWN_BLOCK, meshcat=Meshcat())
    simulator.get_system().ForcedPublish(simulator.get_context())
    simulator.AdvanceTo(15.0)
    times = sink.FindLog(simulator.get_context()).sample_times()
    assert len(times) == 15842
    assert np.isin(np.arange(1, 961) / 64, times).all()
