"""`-o FILE` of commands that write one file, `-o -` being the standard output; `--json` of those that report."""

from __future__ import annotations

import argparse
import contextlib
import json
import os
import shutil
import sys
import tempfile
from collections.abc import Callable, Iterator
from typing import Any

STDOUT = "-"


def add_output(parser: argparse.ArgumentParser, default: str) -> None:
    """Declares `-o`."""
    text = f"file to write, - for the standard output (default: {default})"
    parser.add_argument("-o", "--output", metavar="FILE", help=text)


def add_json(parser: argparse.ArgumentParser, text: str) -> None:
    """Declares `--json`; `text` says what it has."""
    parser.add_argument("--json", action="store_true", help=f"{text}, for programs")


def print_json(value: Any) -> None:
    """Prints one JSON value."""
    print(json.dumps(value, indent=2))


@contextlib.contextmanager
def reporting(options: argparse.Namespace) -> Iterator[dict[str, Any]]:
    """An object for what a command has to tell, printed in the end where `--json` asks for it and it has anything.

    What is printed meanwhile, as by a script, then goes to the standard error output.
    """
    told: dict[str, Any] = {}
    if not options.json:
        yield told
        return
    with contextlib.redirect_stdout(sys.stderr):
        yield told
    if told:
        print_json(told)


@contextlib.contextmanager
def output_file(name: str, ending: str) -> Iterator[str]:
    """The absolute path to write to; what is written there for `-` goes to the standard output at the end.

    For `-`, what is printed meanwhile, as by a script, goes to the standard error output: the other holds the file.

    Args:
        name: The file's name, or `-`.
        ending: Of a file for `-`, such as ".html".
    """
    if name != STDOUT:
        yield os.path.abspath(name)  # a script may go elsewhere
        return
    with tempfile.TemporaryDirectory(prefix="sheldrake-") as folder:
        path = os.path.join(folder, f"output{ending}")
        with contextlib.redirect_stdout(sys.stderr):
            yield path
        if os.path.exists(path):
            sys.stdout.flush()
            with open(path, "rb") as file:
                shutil.copyfileobj(file, sys.stdout.buffer)
            sys.stdout.flush()


def say_written(name: str, told: dict[str, Any]) -> None:
    """Says which file was written, where it is not the standard output."""
    told["files"] = [name]
    if name != STDOUT:
        print(f"wrote {name}")


def take_options_behind(options: argparse.Namespace, declare: Callable[[argparse.ArgumentParser], None]) -> None:
    """Takes the command's own options that stand behind the script, too; what follows `--` is all the script's.

    Args:
        options: With the script and its arguments.
        declare: Declares these options, each of which has a value.
    """
    parser = argparse.ArgumentParser(prog=f"sheldrake {options.command}", add_help=False)
    declare(parser)
    known = {name for action in parser._actions for name in action.option_strings}
    own: list[str] = []
    rest: list[str] = []
    words = iter(options.arguments)
    for word in words:
        if word == "--":
            break
        is_own = word.partition("=")[0] in known
        (own if is_own else rest).append(word)
        if is_own and "=" not in word:
            own += [value for value in (next(words, None),) if value is not None]
    parser.parse_args(own, options)
    options.arguments = [*rest, *words]
