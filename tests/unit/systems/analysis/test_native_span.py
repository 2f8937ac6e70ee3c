"""Spans of machine code between which Python looks at the world: budget, Ctrl-C, clock, progress, errors."""

import _thread
import math
import os
import signal
import threading
import time

import numpy as np
import pytest

from sheldrake.systems.analysis import ApplySimulatorConfig, Simulator, SimulatorConfig, SimulatorStatus
from sheldrake.systems.analysis import _progress as progress_module
from sheldrake.systems.framework import (
    DiagramBuilder,
    EventStatus,
    LeafSystem,
    UnrestrictedUpdateEvent,
    WitnessFunctionDirection,
)
from sheldrake.systems.framework._kernels import integrate, loop, program
from sheldrake.systems.primitives import Gain, Integrator, LinearSystem, LogVectorOutput, Sine

SWING = dict(A=[[0.0, 0.001], [-0.001, 1.0]], B=[[0.0], [0.001]], C=np.eye(2), D=np.zeros((2, 1)), time_period=1e-3)


def swinging(*more):
    builder = DiagramBuilder()
    for system in more:
        builder.AddSystem(system)
    wave = builder.AddSystem(Sine(1.0, 3.0, 0.0, 1))
    plant, sum_ = builder.AddSystem(LinearSystem(**SWING)), builder.AddSystem(Integrator(1))
    builder.Connect(wave.get_output_port(0), plant.get_input_port())
    builder.Connect(wave.get_output_port(0), sum_.get_input_port())
    sinks = [LogVectorOutput(s.get_output_port(), builder) for s in (plant, sum_)]
    return builder.Build(), sinks


def logs(simulator, sinks):
    return [a for s in sinks for log in [s.FindLog(simulator.get_context())] for a in (log.sample_times(), log.data())]


def test_a_span_cut_after_every_step_gives_the_same_bits():
    found = []
    for cut in (False, True):
        diagram, sinks = swinging()
        simulator = Simulator(diagram)
        simulator.Initialize()
        if cut:
            for k in range(1, 301):
                simulator.AdvanceTo(k * 1e-3)
        else:
            simulator.AdvanceTo(300 * 1e-3)
        found.append(logs(simulator, sinks))
    for a, b in zip(*found):
        assert np.array_equal(a, b)


def test_control_c_stops_between_steps_and_the_rest_can_follow():
    diagram, sinks = swinging()
    simulator = Simulator(diagram)
    simulator.AdvanceTo(0.01)
    timer = threading.Timer(0.2, os.kill, (os.getpid(), signal.SIGINT))
    timer.start()
    with pytest.raises(KeyboardInterrupt):
        simulator.AdvanceTo(1e6)
    t = simulator.get_context().get_time()
    ticks = round(t / 1e-3)
    assert t == ticks * 1e-3 > 0.01
    simulator.AdvanceTo((ticks + 10) * 1e-3)
    times = sinks[0].FindLog(simulator.get_context()).sample_times()
    assert np.all(np.diff(times) > 0)
    assert np.all(np.isin(np.arange(ticks + 11) * 1e-3, times))


def test_control_c_in_a_python_row_is_control_c():
    """Mostly it comes while machine code runs, and is seen when the next Python row is entered."""

    class Watching(LeafSystem):
        def __init__(self):
            super().__init__()
            self.DeclarePeriodicPublishEvent(1e-3, 0.0, lambda context: None)

    diagram, _ = swinging(Watching())
    simulator = Simulator(diagram)
    simulator.AdvanceTo(0.01)
    rng = np.random.default_rng(1)
    for _ in range(40):
        timer = threading.Timer(rng.uniform(0.01, 0.03), _thread.interrupt_main)
        with pytest.raises(KeyboardInterrupt):
            timer.start()
            simulator.AdvanceTo(1e6)
        timer.join()
        simulator.Initialize()


@pytest.mark.parametrize("rate", [1.0, 2.0])
def test_realtime_rate(rate):
    diagram, _ = swinging()
    simulator = Simulator(diagram)
    simulator.set_target_realtime_rate(rate)
    begin = time.monotonic()
    simulator.Initialize()
    simulator.AdvanceTo(0.3)
    elapsed = time.monotonic() - begin
    assert elapsed > 0.3 / rate - 0.02  # however busy the machine is: the simulator's clock started after this one
    assert 0.0 < simulator.get_actual_realtime_rate() < 1.1 * rate


def test_progress_is_shown_when_somebody_looks(monkeypatch, capsys):
    monkeypatch.setattr(progress_module.Progress, "PATIENCE", 0.0)
    monkeypatch.setattr(progress_module.Progress, "EVERY", 0.0)
    diagram, _ = swinging()
    for watched, asked, expected in ((True, True, True), (True, False, False), (False, True, False)):
        line = progress_module._OnTerminal if watched else lambda: None
        monkeypatch.setattr(progress_module, "_line", line)
        simulator = Simulator(diagram)
        simulator.set_progress(asked)
        simulator.AdvanceTo(3.0)
        text = capsys.readouterr().err
        assert ("of 3 s" in text and "left" in text) == expected
        assert text.endswith("\r") == expected  # the line is wiped


class Fragile(LeafSystem):
    """Fails, in its own way, after a while."""

    def __init__(self, fail, after):
        super().__init__()
        self.fail, self.after = fail, after
        self.DeclareContinuousState(1)
        self.DeclarePerStepPublishEvent(self.publish)

    def DoCalcTimeDerivatives(self, context, derivatives):
        if self.fail == "derivatives" and context.get_time() > self.after:
            raise ZeroDivisionError("stiff")
        derivatives[0] = 1.0

    def publish(self, context):
        if self.fail == "publish" and context.get_time() > self.after:
            return EventStatus.Failed(self, "disk full")
        return EventStatus.Succeeded()


@pytest.mark.parametrize("native", [True, False])
def test_an_error_inside_a_stage_takes_the_step_back(native):
    fragile = Fragile("derivatives", 0.052)
    simulator = Simulator(fragile)
    simulator._native = native
    ApplySimulatorConfig(SimulatorConfig(use_error_control=False, max_step_size=0.01), simulator)
    with pytest.raises(ZeroDivisionError, match="stiff") as info:
        simulator.AdvanceTo(1.0)
    assert "time derivatives of System ::_" in info.value.__notes__[0]
    context = simulator.get_mutable_context()
    assert context.get_time() == pytest.approx(0.05)
    assert context.get_continuous_state_vector()[0] == pytest.approx(0.05)
    fragile.fail = ""
    assert simulator.AdvanceTo(1.0).succeeded()
    assert context.get_continuous_state_vector()[0] == pytest.approx(1.0)


def test_a_handler_that_failed_is_named():
    fragile = Fragile("publish", 0.5)
    simulator = Simulator(fragile)
    with pytest.raises(RuntimeError, match=r"stopped at time .*Fragile.* failed with message: \"disk full\""):
        simulator.AdvanceTo(1.0)


def test_bad_calls():
    diagram, _ = swinging()
    simulator = Simulator(diagram)
    simulator.AdvanceTo(0.5)
    with pytest.raises(RuntimeError, match="before the current time"):
        simulator.AdvanceTo(0.4)
    simulator.get_mutable_context().SetTime(0.1)
    with pytest.raises(RuntimeError, match="requires a call to Initialize"):
        simulator.AdvanceTo(1.0)
    assert simulator.Initialize().reason() is SimulatorStatus.ReturnReason.kReachedBoundaryTime
    simulator.AdvanceTo(0.2)
    simulator.reset_context(None)
    assert not simulator.has_context()
    with pytest.raises(RuntimeError, match="without a Context"):
        simulator.Initialize()
    with pytest.raises(RuntimeError, match="instead of the appropriate"):
        Simulator(diagram, Integrator(1).CreateDefaultContext())
    simulator.set_target_realtime_rate(-1.0)
    assert simulator.get_target_realtime_rate() == 0.0
    with pytest.raises(RuntimeError, match="realtime_rate is nan"):
        simulator.set_target_realtime_rate(math.nan)
    with pytest.raises(TypeError, match="no System"):
        Simulator(3)


def test_the_loop_is_compiled_without_contraction():
    kernels = [k for file in (program, integrate, loop) for k in vars(file).values() if type(k).__name__ == "Kernel"]
    assert len(kernels) > 20 and all(k.strict for k in kernels)


@pytest.mark.twin
@pytest.mark.parametrize("native", [True, False])
def test_open_inputs_of_kernels_are_found_before_anything_is_called(native):
    builder, heard = DiagramBuilder(), []

    class Speaker(LeafSystem):
        def __init__(self):
            super().__init__()
            self.DeclareVectorOutputPort("y", 1, lambda context, y: heard.append(context.get_time()))

    LogVectorOutput(builder.AddSystem(Speaker()).get_output_port(), builder)
    LogVectorOutput(builder.AddSystem(Gain(2.0, 1)).get_output_port(), builder)
    simulator = Simulator(builder.Build())
    simulator._native = native
    with pytest.raises(RuntimeError, match="not connected"):
        simulator.AdvanceTo(0.1)
    assert heard == []


class Ball(LeafSystem):
    """A ball that bounces; a witness function finds when."""

    def __init__(self):
        super().__init__()
        self.DeclareContinuousState(1, 1, 0)
        self.times, hit = [], UnrestrictedUpdateEvent(self.bounce)
        falls = WitnessFunctionDirection.kPositiveThenNonPositive
        self.witness = self.MakeWitnessFunction("floor", falls, lambda context: context.get_continuous_state()[0], hit)

    def DoGetWitnessFunctions(self, context):
        return [self.witness]

    def DoCalcTimeDerivatives(self, context, derivatives):
        derivatives.SetFromVector([context.get_continuous_state()[1], -9.81])

    def bounce(self, context, event, state):
        self.times.append(context.get_time())
        state.get_mutable_continuous_state().SetFromVector([0.0, -0.8 * context.get_continuous_state()[1]])


def test_bounces_are_found_in_machine_code_where_the_interpreted_loop_finds_them():
    found = []
    for native in (True, False):
        ball = Ball()
        simulator = Simulator(ball)
        simulator._native = native
        simulator.get_mutable_context().SetAccuracy(1e-4)
        simulator.get_mutable_context().SetContinuousState([10.0, 0.0])
        simulator.AdvanceTo(8.0)
        found.append([*ball.times, *simulator.get_context().get_continuous_state_vector().CopyToVector()])
        fall = math.sqrt(2.0 * 10.0 / 9.81)
        assert ball.times == pytest.approx(fall * np.array([1.0, 2.6, 3.88, 4.904]), abs=1e-5)
    assert found[0] == found[1]


def test_an_error_while_a_change_of_sign_is_located_stops_the_span():
    seen = []

    class Touchy(Ball):
        def DoCalcTimeDerivatives(self, context, out):
            if seen and context.get_time() < max(seen):  # time goes back: somebody looks for the moment of a change
                raise ZeroDivisionError("sooner than that")
            seen.append(context.get_time())
            super().DoCalcTimeDerivatives(context, out)

    simulator = Simulator(Touchy())
    ApplySimulatorConfig(SimulatorConfig(use_error_control=False, max_step_size=0.1), simulator)
    simulator.get_mutable_context().SetAccuracy(1e-4)
    simulator.get_mutable_context().SetContinuousState([10.0, 0.0])
    with pytest.raises(ZeroDivisionError, match="sooner than that"):
        simulator.AdvanceTo(8.0)
