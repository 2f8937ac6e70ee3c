"""`--json` on every command that reports: one JSON value on the standard output, and nothing else there."""

import argparse
import json
import pathlib
import re
import shutil

import pytest
from tests.unit.cli.test_cli import ROOT, script, sheldrake
from tests.unit.cli.test_output import FALL, log_file

import sheldrake as package
from sheldrake.cli._main import _parser

BLOCK = package.model_path("two_hole_block/two_hole_block.urdf")
MESH = str(next(pathlib.Path(BLOCK).parent.rglob("*.obj")))
SILENT = {
    "run": "a script's own output is all there is",
    "view": "a page",
    "guide": "a text",
    "completion": "a script for a shell",
}
"""Commands that report nothing, and what their output is."""

COMMANDS = {
    "info": lambda folder: ["--json"],
    "doctor": lambda folder: ["--json", BLOCK],
    "convert": lambda folder: ["--json", BLOCK, str(folder / "block.sdf")],
    "mesh2urdf": lambda folder: ["--json", "--units", "m", "-o", str(folder / "part.urdf"), _mesh(folder)],
    "plot": lambda folder: ["--json", "-o", str(folder / "plot.png"), log_file(folder)],
    "plot --list": lambda folder: ["--json", log_file(folder)],
    "report": lambda folder: ["--json", "-o", str(folder / "fall.html"), script(folder, FALL)],
    "page": lambda folder: ["--json", "-o", str(folder / "fall.html"), script(folder, FALL)],
    "c": lambda folder: ["--json", "-o", str(folder / "library"), script(folder, FALL)],
    "fmu": lambda folder: [
        "--json", "--platform", "x86_64-linux", "-o", str(folder / "fall.fmu"), script(folder, FALL),
    ],
    "demo": lambda folder: ["--json", "--headless", "--seconds", "0.1", "--out", str(folder / "out")],
    "precompile --list": lambda folder: ["--json"],
}  # fmt: skip


def _mesh(folder):
    return shutil.copy(MESH, folder / "part.obj")


def documented():
    """What the documentation says the keys of each command's object are; of lists, those of their elements."""
    page = (ROOT / "docs" / "cheatsheet.md").read_text(encoding="utf-8")
    rows = re.findall(r"^\| `sheldrake ([^`]*) --json` \| (object|list of objects) \| (.*) \|$", page, re.MULTILINE)
    return {command: (kind, re.findall(r"`([^`]*)`", keys)) for command, kind, keys in rows}


def test_every_command_reports_to_programs_or_says_why_not():
    (commands,) = (a for a in _parser()._actions if isinstance(a, argparse._SubParsersAction))
    with_json = {name for name, command in commands.choices.items() if "--json" in command._option_string_actions}
    assert with_json == set(commands.choices) - set(SILENT)
    assert {name.partition(" ")[0] for name in COMMANDS} == with_json
    assert set(documented()) == set(COMMANDS)


@pytest.mark.parametrize("command", COMMANDS)
def test_one_json_value_with_the_documented_keys(tmp_path, command):
    done = sheldrake(*command.split(), *COMMANDS[command](tmp_path), cwd=tmp_path)
    if command == "c" and done.returncode and "ziglang" in done.stderr:
        pytest.skip("needs ziglang")
    value = json.loads(done.stdout)  # raises where anything else is printed
    kind, keys = documented()[command]
    assert isinstance(value, dict if kind == "object" else list)
    for item in [value] if kind == "object" else value:
        assert set(keys) <= set(item), done.stdout
        if command != "info":
            assert set(item) <= set(keys), "what is told is documented"
    for file in value.get("files", []) if isinstance(value, dict) else []:
        assert (tmp_path / file).exists()
    assert done.returncode == 0, done.stderr


def test_what_a_script_prints_is_not_in_the_way(tmp_path):
    done = sheldrake("page", "--json", script(tmp_path, FALL), cwd=tmp_path)
    assert json.loads(done.stdout) == {"files": ["script.html"]}
    assert "the script speaks" in done.stderr and "wrote script.html" in done.stderr


@pytest.mark.parametrize("command", ["report", "page", "plot"])
def test_what_fails_says_nothing_to_programs(tmp_path, command):
    done = sheldrake(command, "--json", str(tmp_path / "missing.py"), cwd=tmp_path)
    assert done.returncode in (1, 2) and done.stdout == "" and "missing" in done.stderr


def test_one_output_takes_one_thing(tmp_path):
    done = sheldrake("plot", "--json", "-o", "-", log_file(tmp_path), cwd=tmp_path)
    assert done.returncode == 2 and done.stdout == ""
    assert "--json and -o - both want the standard output" in done.stderr
