"""Prints what `program()` of a script gives, as numbers: `python numbers_of_program.py pydrake script.py`."""

import json
import pathlib
import re
import sys

import numpy as np

RUNS = re.compile(r"\nfor _ in range\(\d+\):\n    program\(\)\n")
"""How the scripts run their program several times; once is enough here."""


def numbers(given):
    """All numbers in nested tuples, lists, and arrays, in order."""
    if isinstance(given, (list, tuple)):
        return [x for one in given for x in numbers(one)]
    return np.asarray(given, dtype=float).ravel().tolist()


def main(library, script):
    if library == "sheldrake":
        import sheldrake.as_pydrake  # noqa: F401
    path = pathlib.Path(script)
    sys.path.insert(0, str(path.parent))
    names = {"__name__": "__main__", "__file__": script}
    exec(compile(RUNS.sub("\n", path.read_text(encoding="utf-8")), script, "exec"), names)
    print(json.dumps(numbers(names["program"]())))


if __name__ == "__main__":
    main(*sys.argv[1:])
