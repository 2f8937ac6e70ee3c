"""What the command line understands. Each command lives in its own file, imported when it is called."""

from __future__ import annotations

import argparse
import difflib
import importlib
import os
import sys

from sheldrake import __version__
from sheldrake.cli._output import STDOUT, add_json

_DESCRIPTION = """\
Drake's modelling system for robots, in Python all the way down.

Try, in this order:

  sheldrake demo                 a block falls and comes to rest, in a page, with log and plot
  sheldrake mesh2urdf part.stl   a part from CAD becomes a model
  sheldrake view robot.urdf      a model in a page, with a slider for each joint
  sheldrake run script.py        runs a script written for pydrake, as it is
  sheldrake guide                ten idioms, how to read errors, what differs from pydrake and MuJoCo
  sheldrake info                 what is installed, and where compiled kernels are kept
"""

_EXIT_CODES = """\
exit codes:
  0     done
  1     not done, or done and found wanting (doctor: errors are left); the last line says why
  2     a command, an option or a file that cannot be understood
  3     done, but for something left out (convert --strict)
  130   ended by Ctrl-C
  141   nobody reads the output any more
"""

_INTERRUPTED, _READER_GONE = 130, 141  # what shells say of a program that Ctrl-C ended, and whose output nobody reads

_RUN = """\
Runs a Python script in which `import pydrake` means sheldrake, whether or not Drake is installed.

The script sees its own arguments and the name __main__, as under `python script.py`. Under pydrake's names Drake's
defaults hold (one contact point a pair). To use sheldrake's own defaults, import sheldrake in the script instead.
"""

_RUN_EXAMPLES = """\
examples:
  sheldrake run simulate.py --duration 5      arguments after the script are the script's
  sheldrake run -m my_package.simulate        a module instead of a file, as under `python -m`
"""

_PRECOMPILE = """\
Compiles the kernels now that would otherwise be compiled when a simulation first needs them.

They are kept in your cache folder (see `sheldrake info`), for this machine and these versions, so it is done once.
"""

_TOOLS = {
    "demo": "drop a block, or a part of yours: viewer, log, plot, replay",
    "view": "a model in a page, with a slider for each joint",
    "mesh2urdf": "a part from CAD to a robot description",
    "doctor": "faults of a robot description, and their fixes",
    "convert": "a robot description in another format",
    "report": "one page about a run: replay, plots, contacts, diagram",
    "plot": "a picture of a log",
    "page": "one page that simulates what a script simulates",
    "c": "what a script simulates as a C library",
    "fmu": "what a script simulates as an FMU, for other simulation tools",
    "guide": "ten idioms, how to read errors, what differs",
    "completion": "commands and options for the Tab key of bash, zsh, fish",
}
"""Commands whose file declares their arguments, and what they are for, in the order in which people need them."""


class _Help(argparse.RawDescriptionHelpFormatter):
    """Help in which each command and most options stand on the line of what they are for."""

    def __init__(self, prog: str):
        super().__init__(prog, max_help_position=30)
        self._action_max_length = 4 + max(map(len, _TOOLS))  # argparse does not count that commands are indented


def _parser() -> argparse.ArgumentParser:
    formatter = _Help
    parser = argparse.ArgumentParser(
        prog="sheldrake", description=_DESCRIPTION, epilog=_EXIT_CODES, formatter_class=formatter
    )
    parser.add_argument("--version", action="version", version=f"sheldrake {__version__}")
    commands = parser.add_subparsers(dest="command", metavar="COMMAND")

    run = commands.add_parser(
        "run",
        help="run a script written for pydrake",
        description=_RUN,
        epilog=_RUN_EXAMPLES,
        formatter_class=formatter,
    )
    run.add_argument("-m", dest="is_module", action="store_true", help="SCRIPT is the name of a module")
    run.add_argument("script", metavar="SCRIPT", nargs="?", help="the script, or `-` for standard input")
    run.add_argument("arguments", nargs=argparse.REMAINDER, metavar="ARG", help="arguments of the script")

    for name, text in _TOOLS.items():
        module = importlib.import_module(f"sheldrake.cli._{name}")
        command = commands.add_parser(name, help=text, description=module.__doc__, formatter_class=formatter)
        module.add_arguments(command)

    precompile = commands.add_parser(
        "precompile", help="compile all kernels now", description=_PRECOMPILE, formatter_class=formatter
    )
    precompile.add_argument("--list", action="store_true", help="only say which kernels there are")
    add_json(precompile, "kernels and failures")

    text = "versions, cache folder, compiled kernels, threads"
    info = commands.add_parser("info", help=text, description=f"Says what is installed: {text}.")
    add_json(info, "all of it")
    return parser


def _misspelt(parser: argparse.ArgumentParser, words: list[str]) -> str | None:
    """What to say of a command that does not exist; None where there is one, or none is given."""
    commands = [c for action in parser._subparsers._group_actions for c in action.choices]  # type: ignore[union-attr]
    if not words or words[0].startswith("-") or words[0] in commands:
        return None
    close = difflib.get_close_matches(words[0], commands, n=1)
    hint = f"did you mean '{close[0]}'?" if close else f"there are {', '.join(commands)}."
    return f"sheldrake: there is no command '{words[0]}'; {hint}"


def _command(parser: argparse.ArgumentParser, name: str | None) -> argparse.ArgumentParser:
    """What reads the options of a command; of none, the options of all."""
    return parser if name is None else parser._subparsers._group_actions[0].choices[name]  # type: ignore


def _no_option(command: argparse.ArgumentParser, word: str) -> str:
    """What to say of a word that a command does not understand."""
    close = difflib.get_close_matches(word.partition("=")[0], command._option_string_actions, n=1)
    if not word.startswith("-"):
        return f"what is '{word}' for? One word too many."
    return f"there is no option '{word}'" + (f"; did you mean '{close[0]}'?" if close else ".")


def main(argv: list[str] | None = None) -> int:
    """Runs the command.

    Args:
        argv: The words after `sheldrake`; by default the process's own.

    Returns:
        The exit status: 0 when all went well.
    """
    parser = _parser()
    words = sys.argv[1:] if argv is None else argv
    unknown = _misspelt(parser, words)
    if unknown is not None:
        print(unknown, file=sys.stderr)
        return 2
    args, unread = parser.parse_known_args(words)
    if unread:
        _command(parser, args.command).error(_no_option(_command(parser, args.command), unread[0]))
    if args.command == "run" and args.script is None:
        _command(parser, "run").error("give a script: sheldrake run script.py")
    if getattr(args, "json", False) and getattr(args, "output", None) == STDOUT:
        parser.error("--json and -o - both want the standard output")
    if args.command is None:
        parser.print_help()
        return 0
    try:
        status = importlib.import_module(f"sheldrake.cli._{args.command}").run(args)
        sys.stdout.flush()
        return status
    except ModuleNotFoundError as error:
        if args.command == "run" or error.name not in ("llvmlite", "ziglang"):
            raise
        print(f"sheldrake {args.command}: {error}", file=sys.stderr)
        return 1
    except KeyboardInterrupt:
        print("\nInterrupted.", file=sys.stderr)
        return _INTERRUPTED
    except BrokenPipeError:
        if args.command == "run":
            raise
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())  # else Python complains once more at exit
        return _READER_GONE
