"""LLVM's text of all entry kernels, as hashes: `python tools/kernel_texts.py`. The same on every Python and machine.

    python tools/kernel_texts.py --with python3.10 --with /somewhere/bin/python3.14

runs itself with other Pythons, which need NumPy, and ends with status 1 if one has another text.
"""

from __future__ import annotations

import argparse
import hashlib
import importlib.util
import json
import os
import pathlib
import subprocess
import sys
import types

ROOT = pathlib.Path(__file__).resolve().parents[1]


def texts() -> dict[str, str]:
    """LLVM's text of each entry of the library."""
    if importlib.util.find_spec("llvmlite") is None:  # which makes machine code of texts, and is not for every Python
        sys.modules["llvmlite"] = sys.modules["llvmlite.binding"] = types.ModuleType("llvmlite")
    from sheldrake.common._native.build import entries
    from sheldrake.common._native.compiler.module import text_of

    return {name: text_of(kernel, "entry") for name, kernel in entries().items()}


def hashes() -> dict[str, str]:
    """The hash of each entry's text."""
    return {name: hashlib.sha256(text.encode()).hexdigest() for name, text in texts().items()}


def hashes_of(python: str) -> dict[str, str]:
    """What another Python says."""
    environment = {**os.environ, "PYTHONPATH": str(ROOT / "src")}
    command = [python, str(pathlib.Path(__file__).resolve()), "--json"]
    done = subprocess.run(command, capture_output=True, text=True, env=environment, check=True)
    return json.loads(done.stdout)


def main() -> int:
    """What the command does."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0] if __doc__ else "")
    parser.add_argument("--with", dest="others", action="append", default=[], metavar="PYTHON")
    parser.add_argument("--json", action="store_true", help="all hashes, for programs")
    given = parser.parse_args()
    own = hashes()
    if given.json:
        print(json.dumps(own))
        return 0
    whole = hashlib.sha256(json.dumps(own).encode()).hexdigest()
    print(f"{len(own)} entries: {whole[:20]} (Python {sys.version.partition(' ')[0]})")
    wrong = 0
    for python in given.others:
        other = hashes_of(python)
        differs = sorted(name for name in own.keys() | other.keys() if own.get(name) != other.get(name))
        wrong += bool(differs)
        print(f"{python}: {'the same' if not differs else 'differs in ' + ', '.join(differs)}")
    return bool(wrong)


if __name__ == "__main__":
    sys.exit(main())
