"""Where a script that imports pydrake is slower here than with Drake, call by call.

    python tools/compare_speed.py script.py [arguments of the script] [--rounds 3] [--rows 15] [--all]
    python tools/compare_speed.py benchmarks/in_the_loop/[!_]*.py --summary

Each script runs with Drake and with sheldrake in processes of their own, taking turns. Every call that is written in
it, or in a module beside it, is timed (time of the processor). What a call took does not contain the calls that the
script makes meanwhile: what a callback asks for is counted where it asks. So a line such as `simulator.AdvanceTo(1.0)`
stands for the library alone, and for the plain Python of callbacks, which is the same with both.

First calls are told apart from later ones: they load, compile and allocate. Times are those of the best round.
`--summary` prints a line a script: what passes until its function `program` has run once, imports and all, and what a
later call of it takes.
"""

from __future__ import annotations

import argparse
import ast
import json
import os
import pathlib
import subprocess
import sys
import tempfile
from typing import Any, NamedTuple

ROOT = pathlib.Path(__file__).resolve().parents[1]
LIBRARIES = ("Drake", "sheldrake")
BYTECODE = pathlib.Path(tempfile.gettempdir()) / f"compare-speed-bytecode-{os.getuid()}"
LOOK_AT_THEIR_CALLER = {"super", "locals", "globals", "vars", "dir", "eval", "exec"}
"""Builtin functions that must be called from the very place."""


class Site(NamedTuple):
    """A call as it is written."""

    file: str
    line: int
    column: int
    text: str


class Times(NamedTuple):
    """What the calls of one site took [s]: without what the script called meanwhile, and as a whole.

    `first_end` is when the first call had ended, counted from the start of the process.
    """

    count: int
    first: float
    rest: float
    whole_first: float
    whole_rest: float
    first_end: float

    def later(self) -> float:
        """Of a later call, on average [s]; not a number if there was one call only."""
        return self.rest / (self.count - 1) if self.count > 1 else float("nan")

    def total(self) -> float:
        """Of all calls [s]."""
        return self.first + self.rest


NONE = Times(0, 0.0, 0.0, 0.0, 0.0, 0.0)


# --- in the process of the script


class Recorder:
    """Times calls of many sites, each without those inside it."""

    def __init__(self) -> None:
        self.sites: list[Site] = []
        self.counts: list[int] = []
        self.firsts: list[list[float]] = []  # without inner calls, as a whole, end
        self.rests: list[list[float]] = []

    def add(self, site: Site) -> int:
        """Number of a new site."""
        self.sites.append(site)
        self.counts.append(0)
        self.firsts.append([0.0, 0.0, 0.0])
        self.rests.append([0.0, 0.0])
        return len(self.sites) - 1

    def timed(self) -> Any:
        """`call(site, function, ...)`, which calls the function."""
        from time import process_time

        counts, firsts, rests = self.counts, self.firsts, self.rests
        inside = [0.0]

        def call(site: int, function: Any, /, *args: Any, **kwargs: Any) -> Any:
            inside.append(0.0)
            begin = process_time()
            try:
                return function(*args, **kwargs)
            finally:
                end = process_time()
                took = end - begin
                own = took - inside.pop()
                inside[-1] += took
                counts[site] += 1
                if counts[site] == 1:
                    firsts[site] = [own, took, end]
                else:
                    rests[site][0] += own
                    rests[site][1] += took

        return call


class Rewriter(ast.NodeTransformer):
    """Sends every call of a module through `Recorder.timed`."""

    def __init__(self, recorder: Recorder, file: str) -> None:
        self.recorder, self.file = recorder, file

    def visit_Call(self, node: ast.Call) -> ast.AST:
        """The call, timed."""
        name = node.func.id if isinstance(node.func, ast.Name) else ""
        text = ast.unparse(node)
        self.generic_visit(node)
        if name in LOOK_AT_THEIR_CALLER:
            return node
        site = self.recorder.add(Site(self.file, node.lineno, node.col_offset, text))
        head = [ast.Constant(site), node.func]
        timed = ast.Call(ast.Name("__timed_call__", ast.Load()), [*head, *node.args], node.keywords)
        return ast.copy_location(timed, node)


def code_of(path: pathlib.Path, recorder: Recorder) -> Any:
    """A module's code with its calls timed."""
    tree = ast.parse(path.read_text(encoding="utf-8"), str(path))
    tree = ast.fix_missing_locations(Rewriter(recorder, path.name).visit(tree))
    return compile(tree, str(path), "exec")


def run_timed(script: pathlib.Path, arguments: list[str], library: str, out: pathlib.Path) -> None:
    """Runs a script with one of the libraries and writes what its calls took."""
    import builtins
    import importlib.machinery
    import types

    if library == "sheldrake":
        sys.path.insert(0, str(ROOT / "src"))
        import sheldrake.as_pydrake  # noqa: F401
    recorder = Recorder()
    builtins.__timed_call__ = recorder.timed()  # type: ignore[attr-defined]

    class Beside(importlib.machinery.SourceFileLoader):
        def source_to_code(self, data: Any, path: Any, *args: Any, **kwargs: Any) -> Any:
            return code_of(pathlib.Path(path), recorder)

        def get_code(self, fullname: str) -> Any:
            return code_of(pathlib.Path(self.get_filename(fullname)), recorder)

    class Finder(importlib.machinery.PathFinder):
        @classmethod
        def find_spec(cls, fullname: str, path: Any = None, target: Any = None) -> Any:
            spec = importlib.machinery.PathFinder.find_spec(fullname, [str(script.parent)] if path is None else path)
            if spec is None or not spec.origin or script.parent not in pathlib.Path(spec.origin).parents:
                return None
            if spec.origin.endswith(".py"):
                spec.loader = Beside(fullname, spec.origin)
            return spec

    sys.meta_path.insert(0, Finder)
    sys.argv = [str(script), *arguments]
    sys.path[0] = str(script.parent)
    module = types.ModuleType("__main__")
    module.__file__ = str(script)
    sys.modules["__main__"] = module
    exec(code_of(script, recorder), vars(module))
    rows = [
        (tuple(site), (count, first[0], rest[0], first[1], rest[1], first[2]))
        for site, count, first, rest in zip(recorder.sites, recorder.counts, recorder.firsts, recorder.rests)
        if count
    ]
    out.write_text(json.dumps(rows))


# --- in the process that compares


def measure(script: pathlib.Path, arguments: list[str], rounds: int) -> dict[str, dict[Site, Times]]:
    """Best times of each site, by library.

    Raises:
        SystemExit: the script failed with one of the libraries.
    """
    best: dict[str, dict[Site, Times]] = {library: {} for library in LIBRARIES}
    for _ in range(rounds):
        for library in LIBRARIES:
            for site, times in _run(script, arguments, library).items():
                known = best[library].get(site)
                if known is not None:
                    times = Times(times.count, *map(min, times[1:], known[1:]))
                best[library][site] = times
    return best


def _run(script: pathlib.Path, arguments: list[str], library: str) -> dict[Site, Times]:
    with tempfile.TemporaryDirectory() as folder:
        out = pathlib.Path(folder) / "times.json"
        command = [sys.executable, __file__, str(script), *arguments, "--in-process", library, str(out)]
        environment = {**os.environ, "SHELDRAKE_QUIET": "1", "PYTHONPYCACHEPREFIX": str(BYTECODE)}
        environment.pop("PYTHONDONTWRITEBYTECODE", None)  # users import what was compiled before
        done = subprocess.run(command, check=False, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, env=environment)
        if done.returncode or not out.exists():
            sys.exit(f"{script} failed with {library}:\n{done.stdout.decode()}")
        return {Site(*site): Times(*times) for site, times in json.loads(out.read_text())}


def show(title: str, best: dict[str, dict[Site, Times]], rows: int, everything: bool) -> None:
    """Prints the sites where most time is lost against Drake, or most is spent."""
    drake, ours = (best[library] for library in LIBRARIES)
    found = []
    for site in {*drake, *ours}:
        a, b = drake.get(site, NONE), ours.get(site, NONE)
        found.append((b.total() - a.total(), site, a, b))
    found.sort(key=lambda row: -row[0])
    total = [sum(t.total() for t in best[library].values()) for library in LIBRARIES]
    print(f"{title}: {total[1]:.3f} s, Drake {total[0]:.3f} s, ratio {total[1] / total[0]:.2f}")
    print(f"{'calls':>7} {'first ms':>9} {'Drake':>9} {'later us':>9} {'Drake':>9} {'ratio':>6} {'lost ms':>8}  call")
    for lost, site, a, b in found[: None if everything else rows]:
        if lost <= 0 and not everything:
            break
        ratio = b.later() / a.later() if a.count > 1 and b.count > 1 else b.first / a.first if a.first else float("nan")
        text = " ".join(site.text.split())
        text = text if len(text) <= 70 else text[:67] + "..."
        print(
            f"{b.count:7d} {1e3 * b.first:9.2f} {1e3 * a.first:9.2f} {1e6 * b.later():9.1f} {1e6 * a.later():9.1f} "
            f"{ratio:6.2f} {1e3 * lost:8.1f}  {site.file}:{site.line} {text}"
        )


def summary_line(script: pathlib.Path, best: dict[str, dict[Site, Times]]) -> str:
    """The script until its first `program()` has ended, imports and all, and a later one [s]: ours, Drake's, ratio."""
    found = []
    for library in LIBRARIES:
        times = [t for site, t in best[library].items() if site.text == "program()"]
        if len(times) != 1 or times[0].count < 2:
            sys.exit(f"{script}: --summary wants a script that calls program() in one place, twice or more.")
        found.append((times[0].first_end, times[0].whole_rest / (times[0].count - 1)))
    (first_a, later_a), (first_b, later_b) = found
    return (
        f"{script.stem:28s} {first_b:9.3f} {first_a:9.3f} {first_b / first_a:6.2f} "
        f"{later_b:9.4f} {later_a:9.4f} {later_b / later_a:6.2f}"
    )


def main() -> None:
    """Compares the scripts of the command line."""
    if "--in-process" in sys.argv:
        at = sys.argv.index("--in-process")
        script, *arguments = sys.argv[1:at]
        run_timed(pathlib.Path(script).resolve(), arguments, sys.argv[at + 1], pathlib.Path(sys.argv[at + 2]))
        return
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("script", type=pathlib.Path, nargs="+")
    parser.add_argument("--rounds", type=int, default=3)
    parser.add_argument("--rows", type=int, default=15)
    parser.add_argument("--all", action="store_true", help="also the calls in which we are faster")
    parser.add_argument("--summary", action="store_true", help="a line a script")
    options, arguments = parser.parse_known_args()
    if options.summary:
        print(f"{'':28s} {'first s':>9} {'Drake':>9} {'ratio':>6} {'later s':>9} {'Drake':>9} {'ratio':>6}")
    for script in options.script:
        best = measure(script, arguments, options.rounds)
        if options.summary:
            print(summary_line(script, best), flush=True)
        else:
            show(script.name, best, options.rows, options.all)


if __name__ == "__main__":
    main()
