"""One picture of all real robots, as `sheldrake view` shows them first.

    python tools/make_robot_sheet.py [NAME ...]

Opens every description of example-robot-data in Chromium and measures its picture (it is the test that `dev.py robots`
runs); the pictures are in build/robots/robots.png. Names, or parts of them, choose robots.
"""

from __future__ import annotations

import os
import pathlib
import subprocess
import sys

ROOT = pathlib.Path(__file__).resolve().parents[1]
TEST = "tests/crosscheck/robots/test_robots_in_the_page.py"


def main(names: list[str]) -> int:
    """Runs the test and leaves the picture; returns its exit status."""
    folder = ROOT / "build" / "robots"
    environment = {**os.environ, "SHELDRAKE_PICTURES": str(folder)}
    chosen = ["-k", " or ".join(names)] if names else []
    status = subprocess.run([sys.executable, "-m", "pytest", "-q", TEST, *chosen], cwd=ROOT, env=environment).returncode
    print(f"look at {folder / 'robots.png'}")
    return status


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
