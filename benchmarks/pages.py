"""Pages that simulate, against the same diagrams as machine code: how large, how fast, how far apart.

    python benchmarks/pages.py [NAME ...]

Each is an example of this repository, as `sheldrake page` takes it, or the arm of `arm.py` under a PidController. The
module that browsers run is run in Node. Times are of the processor, the best of several runs.
Differences are of all states at the times given, mostly before the first contact and long after it.
"""

from __future__ import annotations

import importlib
import pathlib
import subprocess
import sys
import tempfile
import time
from typing import Any

import numpy as np

ROOT = pathlib.Path(__file__).resolve().parents[1]
sys.path[:0] = [str(ROOT), str(ROOT / "src")]

from sheldrake.export import Freeze, FrozenSimulation, SavePage  # noqa: E402
from sheldrake.systems.analysis import Simulator  # noqa: E402

SCENES = {
    "block": ("drop_the_block", 0.1, 1.0),
    "arm": ("arm", 0.5, 1.0),
    "cart-pole": ("cart_pole_lqr", 0.5, 1.0),
    "quadruped": ("quadruped", 0.005, 1.0),
    "clutter": ("clutter", 0.02, 1.0),
    "soft ball": ("soft_ball", 0.05, 1.0),
}
ADVANCE = Simulator.AdvanceTo
ROUNDS = 10


class _Found(BaseException):
    """The simulator that an example would advance."""


def simulator_of(example: str) -> Any:
    """What an example simulates, before its first step."""
    if example == "arm":
        from tests.unit.export.exported_pages import arm

        return arm()

    def advance_to(self: Any, *_: Any) -> None:
        raise _Found(self)

    Simulator.AdvanceTo = advance_to  # type: ignore[method-assign,assignment]
    try:
        importlib.import_module(f"examples.{example}").main()
    except _Found as found:
        return found.args[0]
    finally:
        Simulator.AdvanceTo = ADVANCE  # type: ignore[method-assign]
    raise RuntimeError(f"{example} simulates nothing")


def native(frozen: Any, last: float) -> float:
    """CPU time of a step as machine code [us]."""
    simulation = FrozenSimulation(frozen)
    steps, best = frozen.description["words"]["steps"], np.inf
    for _ in range(ROUNDS):
        simulation.Reset()
        begin, start = int(simulation._words[steps]), time.process_time()
        simulation.AdvanceTo(last)
        spent = time.process_time() - start
        best = min(best, spent / (int(simulation._words[steps]) - begin) * 1e6)
    return best


def main(names: list[str]) -> None:
    print(f"{'':10} {'page':>8} {'native':>9} {'wasm':>9} {'':5}  differences of states")
    for name in names or SCENES:
        example, *times = SCENES[name]
        simulator = simulator_of(example)
        frozen = Freeze(simulator)
        with tempfile.TemporaryDirectory() as folder:
            page = pathlib.Path(folder) / "page.html"
            SavePage(simulator, page)
            size = page.stat().st_size / 1e6
            command = ["node", str(ROOT / "tests/unit/export/run_page.mjs"), str(page), *map(str, times)]
            done = subprocess.run(command, capture_output=True, text=True, check=True)
        wasm, own = float(done.stderr.split()[-1]), native(frozen, times[-1])
        simulation, differences = FrozenSimulation(frozen), []
        for t, line in zip(times, done.stdout.splitlines()):
            simulation.AdvanceTo(t)
            state = np.concatenate([simulation.GetState(s) for s in frozen.state_names()])
            found = np.array([int(word, 16) for word in line.split()], np.uint64).view(float)
            differences.append(f"{abs(found - state).max():.1e} at {t} s")
        print(f"{name:10} {size:5.2f} MB {own:6.2f} us {wasm:6.2f} us {wasm / own:5.2f}  {', '.join(differences)}")


if __name__ == "__main__":
    main(sys.argv[1:])
