"""Whether motions are the same bits as before: `python tools/state_hashes.py --against before.json`.

    python tools/state_hashes.py                      a line for each scene of motion_scenes.py: its name and a hash
    python tools/state_hashes.py --write before.json  keeps them, and beside them in before.npz the numbers themselves
    python tools/state_hashes.py --against before.json     says what has changed and by how much; status 1 if anything

Run it with --write before a change that must not change any result, and with --against after it. Hashes hold for one
machine and one compiler: code for another processor may round otherwise. `--only` takes scenes whose names contain a
text. All scenes take some seconds, and two minutes more where kernels must be compiled first.
"""

from __future__ import annotations

import argparse
import hashlib
import json
import pathlib
import sys
import traceback
import warnings
from collections.abc import Callable

import numpy as np

ROOT = pathlib.Path(__file__).resolve().parents[1]
sys.path[:0] = [str(ROOT), str(ROOT / "src")]
FAILED = "failed"
"""Stands for the hash of a scene that could not be run."""


def hash_of(numbers: np.ndarray) -> str:
    """Of shape and bits: -0.0 is not 0.0 here."""
    numbers = np.ascontiguousarray(numbers, float)
    return hashlib.sha256(f"{numbers.shape}".encode() + numbers.tobytes()).hexdigest()[:16]


def run(scene: Callable[[], np.ndarray]) -> tuple[str, np.ndarray]:
    """Hash and numbers of a scene; of one that raises, what it raises is printed."""
    try:
        numbers = np.asarray(scene(), float)
    except Exception:
        traceback.print_exc()
        return FAILED, np.zeros(0)
    return hash_of(numbers), numbers


def difference(before: np.ndarray | None, now: np.ndarray) -> str:
    """How far two outcomes are apart, in words."""
    if before is None:
        return "the numbers of before are not there"
    if before.shape != now.shape:
        return f"shape {now.shape}, before {before.shape}"
    same = (before == now) | (np.isnan(before) & np.isnan(now))
    if same.all():
        return "only signs of zeros or kinds of NaN differ"
    with np.errstate(invalid="ignore"):
        apart = np.where(same, 0.0, np.abs(now - before))
    at = int(np.argmax(apart))  # the first NaN, if there is one
    return f"{(~same).sum()} of {now.size} numbers, largest difference {apart.flat[at]:.3g} (now {now.flat[at]:.6g})"


def numbers_beside(path: pathlib.Path) -> pathlib.Path:
    """Where the numbers of a file of hashes are."""
    return path.with_suffix(".npz")


def write(path: pathlib.Path, found: dict[str, tuple[str, np.ndarray]]) -> None:
    """Keeps hashes and numbers."""
    path.write_text(json.dumps({name: h for name, (h, _) in found.items()}, indent=1) + "\n", encoding="utf-8")
    np.savez_compressed(numbers_beside(path), **{name: numbers for name, (_, numbers) in found.items()})


def changes(path: pathlib.Path, only: str, found: dict[str, tuple[str, np.ndarray]]) -> list[str]:
    """A line for each scene that is not as it was."""
    before: dict[str, str] = json.loads(path.read_text(encoding="utf-8"))
    lines = [f"{name}: is no more" for name in before if only in name and name not in found]
    kept = np.load(numbers_beside(path)) if numbers_beside(path).exists() else {}
    for name, (now, numbers) in found.items():
        if name not in before:
            lines.append(f"{name}: was not there before")
        elif now == FAILED:
            lines.append(f"{name}: failed")
        elif now != before[name]:
            lines.append(f"{name}: {difference(kept[name] if name in kept else None, numbers)}")
    return lines


def main() -> int:
    """Runs the scenes; 1 if something is not as it was or fails."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--write", type=pathlib.Path, metavar="FILE", help="keep hashes here, numbers beside it")
    parser.add_argument("--against", type=pathlib.Path, metavar="FILE", help="compare with what was kept here")
    parser.add_argument("--only", default="", metavar="SUBSTRING", help="only scenes with this in their names")
    options = parser.parse_args()
    warnings.simplefilter("ignore")
    import sheldrake

    if ROOT not in pathlib.Path(sheldrake.__file__).parents:
        raise RuntimeError(f"sheldrake comes from {sheldrake.__file__}, not from {ROOT}.")
    from tools.motion_scenes import SCENES

    found = {}
    for name, scene in SCENES.items():
        if options.only in name:
            found[name] = run(scene)
            print(name, found[name][0], flush=True)
    if options.write:
        write(options.write, found)
    lines = changes(options.against, options.only, found) if options.against else []
    if options.against:
        print("\n".join(["", *lines]) if lines else f"\nall {len(found)} scenes are as before")
    return int(bool(lines) or FAILED in (h for h, _ in found.values()))


if __name__ == "__main__":
    sys.exit(main())
