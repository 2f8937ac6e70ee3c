"""Block diagrams against Drake: CPU time of signal blocks, a Python controller around a plant, and large diagrams.

    python benchmarks/signals.py [--rounds 7] [--seconds 5] [--blocks 10000]

"50 blocks": ten chains of a sine, a gain, a saturation, a zero-order hold and a discrete derivative, all sampled at
1 kHz, one of them logged. "Python controller": a `LeafSystem` written in Python reads the state of a pendulum plant
and gives its torque, at 1 kHz. "Python filter" also has discrete state of its own, updated in Python. The large diagram
is a chain of gains and unit delays: building it, its first context, a copy of that, and a step of 1 ms.
"""

from __future__ import annotations

import argparse
import importlib
import pathlib
import statistics
import sys
import time
from collections.abc import Callable
from typing import Any

import numpy as np

ROOT = pathlib.Path(__file__).resolve().parents[1]
sys.path[:0] = [str(ROOT), str(ROOT / "src")]

from benchmarks.turns import machine, ratio, take_turns  # noqa: E402

DT = 1e-3
OURS, DRAKE = "sheldrake", "pydrake"

PENDULUM = """<robot name="pendulum">
  <link name="arm"><inertial><origin xyz="0 0 -0.5"/><mass value="1"/>
    <inertia ixx="0.01" iyy="0.01" izz="0.01" ixy="0" ixz="0" iyz="0"/></inertial></link>
  <link name="base"/>
  <joint name="weld" type="fixed"><parent link="world"/><child link="base"/></joint>
  <joint name="pivot" type="revolute"><parent link="base"/><child link="arm"/><axis xyz="0 1 0"/>
    <limit lower="-100" upper="100" effort="100" velocity="100"/></joint>
  <transmission name="t"><type>transmission_interface/SimpleTransmission</type>
    <joint name="pivot"/><actuator name="motor"><mechanicalReduction>1</mechanicalReduction></actuator></transmission>
</robot>"""


def chains(lib: Any) -> Any:
    """Ten chains of five blocks."""
    builder = lib.DiagramBuilder()
    for k in range(10):
        sine = builder.AddSystem(lib.Sine(1.0 + 0.1 * k, 2.0 + k, 0.1 * k, 1))
        gain = builder.AddSystem(lib.Gain(1.5, 1))
        limit = builder.AddSystem(lib.Saturation([-1.0], [1.0]))
        hold = builder.AddSystem(lib.ZeroOrderHold(DT, 1))
        rate = builder.AddSystem(lib.DiscreteDerivative(1, DT))
        builder.Connect(sine.get_output_port(0), gain.get_input_port())
        builder.Connect(gain.get_output_port(), limit.get_input_port())
        builder.Connect(limit.get_output_port(), hold.get_input_port())
        builder.Connect(hold.get_output_port(), rate.get_input_port())
    lib.LogVectorOutput(rate.get_output_port(), builder, DT)
    return builder.Build()


def controller_of(lib: Any, filtered: bool) -> Any:
    """A PD controller as a user writes it; with a filter, the velocity passes a discrete low-pass first."""

    class Controller(lib.LeafSystem):
        def __init__(self):
            super().__init__()
            self.state = self.DeclareVectorInputPort("state", 2)
            self.DeclareVectorOutputPort("torque", 1, self.calc_torque)
            if filtered:
                self.DeclareDiscreteState(1)
                self.DeclarePeriodicDiscreteUpdateEvent(DT, 0.0, self.update)

        def calc_torque(self, context, output):
            x = self.state.Eval(context)
            v = context.get_discrete_state_vector()[0] if filtered else x[1]
            output.SetFromVector([-20.0 * x[0] - 4.0 * v])

        def update(self, context, values):
            v = context.get_discrete_state_vector()[0]
            values.set_value([v + 0.2 * (self.state.Eval(context)[1] - v)])

    return Controller()


def controlled(lib: Any, filtered: bool) -> Any:
    """A pendulum plant, its controller and a log."""
    builder = lib.DiagramBuilder()
    plant, _ = lib.AddMultibodyPlantSceneGraph(builder, DT)
    lib.Parser(plant).AddModelsFromString(PENDULUM, "urdf")
    plant.Finalize()
    plant.get_mutable_joint(plant.GetJointByName("pivot").index()).set_default_positions([1.0])
    controller = builder.AddSystem(controller_of(lib, filtered))
    builder.Connect(plant.get_state_output_port(), controller.get_input_port())
    builder.Connect(controller.get_output_port(), plant.get_actuation_input_port())
    lib.LogVectorOutput(plant.get_state_output_port(), builder, DT)
    return builder.Build()


def stepper(make: Callable[[Any], Any], package: str, seconds: float) -> Callable[[], float]:
    """CPU time of 1 ms [us], over one run after another of one simulator."""
    simulator = importlib.import_module(f"{package}.all")
    simulator = simulator.Simulator(make(simulator))
    until = [DT]
    simulator.AdvanceTo(DT)

    def turn() -> float:
        until[0] += seconds
        start = time.process_time()
        simulator.AdvanceTo(until[0])
        return (time.process_time() - start) / round(seconds / DT) * 1e6

    return turn


def long_chain(lib: Any, blocks: int) -> Any:
    """A chain of `blocks` gains and unit delays, in a builder."""
    builder = lib.DiagramBuilder()
    before = builder.AddSystem(lib.Sine(1.0, 2.0, 0.0, 1)).get_output_port(0)
    for _ in range(blocks // 2):
        gain = builder.AddSystem(lib.Gain(0.999, 1))
        delay = builder.AddSystem(lib.UnitDelay(DT, 1) if hasattr(lib, "UnitDelay") else lib.ZeroOrderHold(DT, 1))
        builder.Connect(before, gain.get_input_port())
        builder.Connect(gain.get_output_port(), delay.get_input_port())
        before = delay.get_output_port()
    return builder


def large(package: str, blocks: int) -> dict[str, float]:
    """CPU times of a large diagram [ms]; of a step [us]."""
    lib = importlib.import_module(f"{package}.all")
    found, clock = {}, time.process_time

    def timed(name: str, call: Callable[[], Any], scale: float = 1e3) -> Any:
        start = clock()
        result = call()
        found[name] = (clock() - start) * scale
        return result

    diagram = timed("build [ms]", lambda: long_chain(lib, blocks).Build())
    timed("first context [ms]", diagram.CreateDefaultContext)
    context = timed("CreateDefaultContext [ms]", diagram.CreateDefaultContext)
    timed("Clone [ms]", context.Clone)
    simulator = lib.Simulator(diagram)
    simulator.AdvanceTo(2 * DT)
    timed("step [us]", lambda: simulator.AdvanceTo(102 * DT), 1e6 / 100)
    return found


def packages() -> list[str]:
    """Ours, and Drake where it is installed."""
    found = [OURS]
    try:
        importlib.import_module(DRAKE)
        found.append(DRAKE)
    except ImportError:
        pass
    return found


def main() -> None:
    """Prints the tables."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--rounds", type=int, default=7)
    parser.add_argument("--seconds", type=float, default=5.0)
    parser.add_argument("--blocks", type=int, default=10_000)
    args = parser.parse_args()
    print(machine())
    scenes = {
        "50 blocks": chains,
        "Python controller": lambda lib: controlled(lib, False),
        "Python filter": lambda lib: controlled(lib, True),
    }
    print(f"{'us per 1 ms':24}{OURS:>12}{DRAKE:>12}   ratio (min-max)")
    for title, make in scenes.items():
        times = take_turns({p: stepper(make, p, args.seconds) for p in packages()}, args.rounds)
        middle = {p: statistics.median(t) for p, t in times.items()}
        print(f"{title:24}" + "".join(f"{middle[p]:12.2f}" for p in middle) + f"   {ratio(times, DRAKE, OURS)}")
    for blocks in (args.blocks // 10, args.blocks):
        found = {p: large(p, blocks) for p in packages()}
        for name in found[OURS]:
            print(f"{blocks} blocks, {name:28}" + "".join(f"{found[p][name]:12.2f}" for p in found))


if __name__ == "__main__":
    np.set_printoptions(precision=3)
    main()
