"""Pages that simulate, against the same diagrams as machine code: how large, how fast, how far apart.

    python benchmarks/pages.py [NAME ...] [--browser | --minutes N]

Each is an example of this repository, as `sheldrake page` takes it, or the arm of `arm.py` under a PidController. The
module that browsers run is run in Node. Times are of the processor, the best of several runs.
Differences are of all states before the first contact, and after a second (a heap's: earlier, for native runs that
begin a last bit apart part as well). With --browser each page is also opened in Chromium, from its file, without a
network or a graphics card: when it can be used, whether its bits are Node's, its memory before and after a minute of
simulated time. With --minutes each page plays for so long by the clock, at five times the speed or as fast as it can,
and its memory is told every half minute.
"""

from __future__ import annotations

import argparse
import pathlib
import subprocess
import sys
import tempfile
import time
from typing import Any

import numpy as np

ROOT = pathlib.Path(__file__).resolve().parents[1]
sys.path[:0] = [str(ROOT), str(ROOT / "src"), str(ROOT / "tests" / "browser")]

from tests.unit.export.exported_pages import SCENES, simulator_of  # noqa: E402

from sheldrake.export import Freeze, FrozenSimulation, SavePage  # noqa: E402

ROUNDS = 10
MINUTE = 60.0  # [s], simulated in a browser while its memory is watched
LOOK = 30.0  # [s] by the clock, between looks at the memory of a page that plays


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


def words_of(line: str) -> np.ndarray:
    """The words that run_page.mjs prints, or `words_in` gives."""
    return np.array([int(word, 16) for word in line.split()], np.uint64)


def words_in(page: Any) -> np.ndarray:
    """Words of all states in an open page."""
    return words_of(page.evaluate("simulation.machine.words()"))


def used(page: Any) -> float:
    """Memory that an open page holds after what nobody needs is collected: its objects, and the module's [MB]."""
    page.call("HeapProfiler.collectGarbage")
    heap = page.call("Runtime.getHeapUsage")["usedSize"]
    return (heap + page.evaluate("simulation.machine.floats.buffer.byteLength")) / 1e6


def played(browser: Any, name: str, path: pathlib.Path, minutes: float) -> None:
    """Has a page play, and tells its memory every half minute; once the browser has compiled all it is to stay."""
    page = browser.open(path.as_uri())
    page.wait_for("window.simulation && simulation.ready && simulation.shown")
    page.evaluate("document.getElementById('speed').value = '5'")
    page.evaluate("window.pictures = 0; (function count() { ++pictures; requestAnimationFrame(count); })()")
    page.click_on("document.getElementById('play')")
    begin, seen = time.monotonic(), []
    print(f"{name}: clock [s], simulated [s], pictures, memory [MB]")
    while (now := time.monotonic() - begin) < 60 * minutes + LOOK / 2:
        simulated, pictures = page.evaluate("[simulation.machine.time, pictures]")
        seen.append(used(page))
        print(f"{now:8.0f} {simulated:9.2f} {pictures:8d} {seen[-1]:8.2f}", flush=True)
        time.sleep(max(0.0, LOOK * len(seen) - (time.monotonic() - begin)))
    late = seen[len(seen) // 2 :]
    print(f"{name}: {min(seen):.2f} to {max(seen):.2f} MB, in the second half {min(late):.2f} to {max(late):.2f} MB")
    browser.close_page(page)


def in_browser(browser: Any, path: pathlib.Path, times: list[float], expected: list[np.ndarray]) -> str:
    """What is said of a page in Chromium."""
    page = browser.open(path.as_uri())
    page.wait_for("window.simulation && simulation.ready")
    ready = page.evaluate("simulation.ready")
    equal = True
    for t, words in zip(times, expected):
        page.evaluate(f"simulation.machine.advanceTo({t})")
        equal = equal and np.array_equal(words_in(page), words)
    page.wait_for("simulation.shown")

    page.evaluate("simulation.machine.advanceTo(simulation.machine.time + 1)")
    before, last = used(page), page.evaluate("simulation.machine.time") + MINUTE
    while page.evaluate("simulation.machine.time") < last:
        page.evaluate("simulation.machine.advanceTo(simulation.machine.time + 1)")
    after = used(page)
    browser.close_page(page)
    same = "same bits as Node" if equal else "OTHER BITS than Node"
    return f"ready {ready:.0f} ms, {same}, {before:.1f} MB, after {MINUTE:.0f} s {after:.1f} MB"


def main(words: list[str] | None = None) -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("names", nargs="*", metavar="NAME", help=", ".join(SCENES))
    parser.add_argument("--browser", action="store_true", help="open each page in Chromium, too")
    parser.add_argument("--minutes", type=float, default=0.0, help="have each page play in Chromium for so long")
    given = parser.parse_args(words)
    if given.minutes:
        from conftest import start

        with start(offline=True, width=640, height=360) as browser, tempfile.TemporaryDirectory() as folder:
            path = pathlib.Path(folder) / "page.html"
            for name in given.names or SCENES:
                SavePage(simulator_of(name), path)
                played(browser, name, path, given.minutes)
        return
    print(f"{'':10} {'page':>8} {'native':>9} {'wasm':>9} {'':5}  differences of states")
    if given.browser:
        from conftest import start

        with start(offline=True, width=860, height=420) as browser:
            report(given.names, browser)
    else:
        report(given.names, None)


def report(names: list[str], browser: Any) -> None:
    """Prints what is found of scenes; all if none is named."""
    for name in names or SCENES:
        scene = SCENES[name]
        times = [scene.before, scene.after]
        simulator = simulator_of(name)
        frozen = Freeze(simulator)
        with tempfile.TemporaryDirectory() as folder:
            page = pathlib.Path(folder) / "page.html"
            SavePage(simulator, page)
            size = page.stat().st_size / 1e6
            command = ["node", str(ROOT / "tests/unit/export/run_page.mjs"), str(page), *map(str, times)]
            done = subprocess.run(command, capture_output=True, text=True, check=True)
            found = [words_of(line) for line in done.stdout.splitlines()]
            more = in_browser(browser, page, times, found) if browser else ""
        wasm, own = float(done.stderr.split()[-1]), native(frozen, times[-1])
        simulation, differences = FrozenSimulation(frozen), []
        for t, state in zip(times, found):
            simulation.AdvanceTo(t)
            expected = np.concatenate([simulation.GetState(s) for s in frozen.state_names()])
            differences.append(f"{abs(state.view(float) - expected).max():.1e} at {t} s")
        print(f"{name:10} {size:5.2f} MB {own:6.2f} us {wasm:6.2f} us {wasm / own:5.2f}  {', '.join(differences)}")
        if more:
            print(f"{'':10} Chromium: {more}", flush=True)


if __name__ == "__main__":
    main()
