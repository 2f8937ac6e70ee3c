"""Where trajectory optimizations end from guesses with noise, with sheldrake and with Drake: costs, failures, CPU time.

    python benchmarks/starts.py acrobot --starts 100 --noise 0.03

Nonlinear programs have many minima, and from one guess it is chance which of them a method finds; from many guesses one
sees which method finds the better ones. Programs are those of `clients.py`. The first start is the program's own guess;
in the others noise is added to all variables but time steps, which are scaled by up to 30 %.
"""

from __future__ import annotations

import argparse
import importlib
import json
import pathlib
import subprocess
import sys
import time
from typing import Any

import numpy as np

sys.path[:0] = [str(pathlib.Path(__file__).resolve().parents[1])]

from benchmarks import clients  # noqa: E402
from benchmarks.turns import machine  # noqa: E402


def run(title: str, package: str, starts: int, noise: float) -> None:
    """Solves a program from all starts and prints costs (nan where it failed) and seconds as JSON."""
    found: dict[str, list[float]] = {"costs": [], "seconds": []}

    def from_all_starts(lib: Any, prog: Any, solver: str) -> tuple[str, float]:
        guess = np.nan_to_num(prog.initial_guess())
        is_step = np.array([v.get_name().startswith("h(") for v in prog.decision_variables()])
        chosen = lib.MakeSolver(lib.ChooseBestSolver(prog))
        for k in range(starts):
            rng = np.random.default_rng(k)
            moved = guess + noise * rng.standard_normal(guess.size)
            moved[is_step] = guess[is_step] * (1.0 + 0.3 * rng.uniform(-1.0, 1.0))
            began = time.process_time()
            result = chosen.Solve(prog, moved if k else guess)
            found["seconds"].append(time.process_time() - began)
            found["costs"].append(result.get_optimal_cost() if result.is_success() else np.nan)
        return "", 0.0

    clients.solved = from_all_starts
    clients.PROGRAMS[title](importlib.import_module(f"{package}.all"), "")
    print(json.dumps(found))


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("program", choices=list(clients.PROGRAMS))
    parser.add_argument("--starts", type=int, default=100)
    parser.add_argument("--noise", type=float, default=0.03)
    parser.add_argument("--run", metavar="PACKAGE", help=argparse.SUPPRESS)
    options = parser.parse_args()
    if options.run:
        run(options.program, options.run, options.starts, options.noise)
        return
    print(machine())
    for package in ("sheldrake", "pydrake"):
        command = [sys.executable, __file__, options.program, "--run", package]
        command += ["--starts", str(options.starts), "--noise", str(options.noise)]
        done = subprocess.run(command, capture_output=True, text=True)
        if done.returncode:
            sys.exit(done.stderr)
        found = json.loads(done.stdout.splitlines()[-1])
        costs = np.array(found["costs"], dtype=float)
        shares = ", ".join(f"{c:.6g}" for c in np.nanquantile(costs, [0.0, 0.1, 0.25, 0.5, 0.75, 0.9, 1.0]))
        print(
            f"{package:10s} own guess {costs[0]:.6g}; {np.isnan(costs).sum()} of {costs.size} fail; costs at 0, 10, "
            f"25, 50, 75, 90, 100 %: {shares}; {np.mean(found['seconds']):.3f} s each",
            flush=True,
        )


if __name__ == "__main__":
    main()
