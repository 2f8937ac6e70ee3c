"""Builds the wheels of all platforms, and the sdist, on this one machine: `python tools/build_wheels.py [OUT]`.

Needs hatchling, llvmlite and ziglang in the environment that runs it. Kernels are lowered once for all platforms.
"""

from __future__ import annotations

import os
import pathlib
import subprocess
import sys
import time

ROOT = pathlib.Path(__file__).resolve().parents[1]


def main() -> None:
    """Writes five wheels and the sdist into OUT (default: dist)."""
    sys.path.insert(0, str(ROOT / "src"))
    from sheldrake.common._native.build import PLATFORMS, build

    start = time.perf_counter()
    out = pathlib.Path(sys.argv[1] if len(sys.argv) > 1 else ROOT / "dist").resolve()
    prebuilt = ROOT / "build" / "prebuilt"
    build(prebuilt, PLATFORMS)
    environment = {**os.environ, "SHELDRAKE_PREBUILT_DIR": str(prebuilt), "PYTHONPATH": str(ROOT / "src")}
    command = [sys.executable, "-m", "hatchling", "build", "-d", str(out)]
    for name in PLATFORMS:
        wheel = {**environment, "SHELDRAKE_WHEEL_PLATFORM": name}
        subprocess.run([*command, "-t", "wheel"], cwd=ROOT, env=wheel, check=True)
    subprocess.run([*command, "-t", "sdist"], cwd=ROOT, env=environment, check=True)
    for path in sorted(out.iterdir()):
        print(f"{path.stat().st_size / 1e6:8.2f} MB  {path.name}")
    print(f"all in {time.perf_counter() - start:.0f} s")


if __name__ == "__main__":
    main()
