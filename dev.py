#!/usr/bin/env python3
"""Everything a fresh clone needs, with only Python: `python dev.py demo`, `python dev.py test`.

Makes the virtual environment `.venv` beside this file, installs what the task needs (pinned in requirements.lock),
runs it there. Standard library only; needs neither apt, conda nor a display.
"""

from __future__ import annotations

import argparse
import importlib.metadata
import os
import pathlib
import shutil
import subprocess
import sys
import venv

ROOT = pathlib.Path(__file__).resolve().parent
VENV = ROOT / ".venv"
PYTHON = VENV / ("Scripts/python.exe" if os.name == "nt" else "bin/python")
EVERYTHING = "[kernels,meshcat,export,test,lint,docs,peers]"
EXTRAS = dict.fromkeys(("test", "lint", "bench", "endure", "torture"), EVERYTHING)
EXTRAS |= {
    "demo": "[kernels]",
    "docs": "[docs,export,gym]",  # its pages simulate
    "release": "[kernels,test,foreign]",
    "foreign": "[kernels,test,foreign]",
    "robots": "[kernels,test,peers,robots]",
}
CHECKS = (
    ("ruff", ["-m", "ruff", "check", "."]),
    ("ruff format", ["-m", "ruff", "format", "--check", "."]),
    ("imports go down", ["-c", "from importlinter.cli import lint_imports_command as c; c()"]),
    ("mypy", ["-m", "mypy"]),
)


def say(text: str) -> None:
    print(f"== {text}", flush=True)


def run(*args: str, **environment: str) -> int:
    with subprocess.Popen([str(PYTHON), *args], cwd=ROOT, env={**os.environ, **environment}) as process:
        while True:
            try:
                return process.wait()
            except KeyboardInterrupt:
                pass  # Ctrl-C reaches the process, too: it ends as it likes


def install(task: str) -> None:
    """Brings .venv up to date for a task; does nothing when it is."""
    stamp = VENV / f".installed-{task}"
    sources = [ROOT / "pyproject.toml", ROOT / "requirements.lock"]
    if stamp.exists() and all(stamp.stat().st_mtime > s.stat().st_mtime for s in sources):
        return
    pip = pip_from_here()
    is_quick = task == "demo" and bool(pip)  # who goes on to work here finds a pip in .venv
    if not PYTHON.exists():
        say(f"making {VENV.name} with Python {sys.version.split()[0]}")
        venv.create(VENV, with_pip=not is_quick)
    say("installing sheldrake and what it needs (a minute or two the first time)")
    pip = [*(pip or [str(PYTHON), "-m", "pip"]), "install", "--quiet", "--disable-pip-version-check"]
    pip += ["--no-compile"]  # Python compiles what is imported when it first is; all of it takes half of the time here
    pip += ["--constraint", "requirements.lock"]
    steps = [["--editable", f".{EXTRAS[task]}"]]
    if is_quick:  # an environment apart for what builds sheldrake takes longer than building
        steps = [["hatchling", "editables"], ["--no-build-isolation", *steps[0]]]
    for step in steps:
        code = subprocess.call([*pip, *step], cwd=ROOT)
        if code != 0:
            sys.exit(code)
    stamp.touch()


def pip_from_here() -> list[str]:
    """The pip of the Python that runs this, made to install into .venv; nothing if there is none that can."""
    try:
        version = [int(n) for n in importlib.metadata.version("pip").split(".")[:2]]
    except (importlib.metadata.PackageNotFoundError, ValueError):
        return []
    return [sys.executable, "-m", "pip", "--python", str(PYTHON)] if version >= [22, 3] else []


def lint() -> int:
    failed = []
    for name, args in CHECKS:
        say(name)
        if run(*args) != 0:
            failed.append(name)
    if failed:
        say("failed: " + ", ".join(failed))
    return len(failed)


def test(rest: list[str]) -> int:
    if rest:
        return run("-m", "pytest", *rest)
    failed = lint()
    say("kernels compiled once, for all test workers")
    failed += run("-m", "sheldrake", "precompile") != 0
    say("tests")
    # A worker that dies is a failure and the end: pytest-xdist 3.8 would wait for ever for the files it was given.
    # Files stay in their order: the browser's, few tests that take long, would be the last, and one worker idle.
    workers = ["-m", "pytest", "-q", "-n", "2", "--dist", "loadfile"]
    workers += ["--max-worker-restart=0", "--no-loadscope-reorder", "--durations=25"]
    failed += run(*workers, "--ignore", "tests/crosscheck") != 0
    say("tests against pydrake, which is not safe among threads: in processes of their own")
    failed += run(*workers, "tests/crosscheck") != 0
    quick = [*workers, "-m", "twin"]
    say("kernels as plain Python (SHELDRAKE_JIT=0)")
    failed += run(*quick, SHELDRAKE_JIT="0") != 0
    say("kernels with bounds checks (SHELDRAKE_BOUNDSCHECK=1)")
    failed += run(*quick, SHELDRAKE_BOUNDSCHECK="1") != 0
    return failed


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    tasks = parser.add_subparsers(dest="task", required=True)
    tasks.add_parser("demo", help="drop a block: page, log, plot, replay; arguments go to `sheldrake demo`")
    tasks.add_parser("test", help="lint and all tests; with arguments, pytest on those")
    tasks.add_parser("lint", help="ruff, import-linter, mypy")
    tasks.add_parser("docs", help="make the site of the documentation in build/docs/html")
    tasks.add_parser("release", help="builds wheels and sdist in dist/, checks them, installs one and runs the README")
    tasks.add_parser("foreign", help="builds all wheels, runs those for ARM and Windows under qemu-user and wine64")
    tasks.add_parser("robots", help="real robots against Drake and Pinocchio: installs example-robot-data and pin")
    tasks.add_parser("endure", help="tests that take minutes: a logged minute killed twenty times at random")
    tasks.add_parser("torture", help="campaigns of chance against parsers, calls, files, kernels, viewer: an hour")
    tasks.add_parser("bench", help="benchmarks against Drake and MuJoCo: drop_the_block (default), queries, arm, ...")
    tasks.add_parser("clean", help="remove .venv")
    options, rest = parser.parse_known_args()
    if options.task == "clean":
        shutil.rmtree(VENV, ignore_errors=True)
        return 0
    install(options.task)
    if options.task == "demo":
        return run("-m", "sheldrake", "demo", *rest)
    if options.task == "docs":
        return run("tools/make_docs.py", *rest)
    if options.task == "release":
        return run("tools/release.py", *rest)
    if options.task == "foreign":
        return run("-m", "pytest", "-q", "tests/foreign", *rest)
    if options.task == "robots":
        return run("-m", "pytest", "-q", "tests/crosscheck/robots", *rest)
    if options.task == "endure":
        return run("-m", "pytest", "-q", "tests/endurance", *rest)
    if options.task == "torture":
        return run("-m", "tools.torture", *rest)
    if options.task == "bench":
        name = rest.pop(0) if rest and not rest[0].startswith("-") else "drop_the_block"
        return run(f"benchmarks/{name}.py", *rest)
    return lint() if options.task == "lint" else test(rest)


if __name__ == "__main__":
    try:
        sys.exit(main())
    except KeyboardInterrupt:
        sys.exit(130)
