"""The wheel for ARM, in an ARM Python run by qemu: installs, drops the block without a compiler, same numbers."""

from __future__ import annotations

import os
import pathlib
import re
import shutil
import subprocess
import sys

import numpy as np
import pytest

TOOLS = ("qemu-aarch64", "apt-get", "dpkg-deb")
pytestmark = pytest.mark.skipif(
    not all(map(shutil.which, TOOLS)), reason=f"needs {', '.join(TOOLS)} (Debian: apt install qemu-user)"
)


@pytest.fixture(scope="module")
def root(tmp_path_factory):
    """A folder with Debian's Python for ARM, fetched beside the system's own packages."""
    folder = tmp_path_factory.mktemp("arm")
    apt = folder / "apt"
    for name in ("var/lib/dpkg", "var/lib/apt/lists/partial", "var/cache/apt/archives/partial"):
        (apt / name).mkdir(parents=True)
    (apt / "var/lib/dpkg/status").touch()
    shutil.copytree("/etc/apt", apt / "etc/apt")
    options = {"Dir": apt, "Dir::State::status": apt / "var/lib/dpkg/status", "APT::Architecture": "arm64"}
    command = ["apt-get", "-qq", *(f"-o{k}={v}" for k, v in options.items()), "-oAPT::Architectures::=arm64"]
    subprocess.run([*command, "update"], check=True)
    packages = ["python3-minimal", "libpython3-stdlib", "libstdc++6"]
    subprocess.run([*command, "-y", "--no-install-recommends", "--download-only", "install", *packages], check=True)
    for package in (apt / "var/cache/apt/archives").glob("*.deb"):
        subprocess.run(["dpkg-deb", "-x", package, folder], check=True)
    return folder


@pytest.fixture(scope="module")
def arm(root, wheels, tmp_path_factory):
    """Runs the ARM Python, in which the wheel and what it needs are installed."""
    python = ["qemu-aarch64", "-L", str(root), str(root / "usr/bin/python3")]
    version = subprocess.run([*python, "-V"], capture_output=True, text=True, check=True).stdout
    (short,) = re.findall(r"3\.\d+", version)
    site = tmp_path_factory.mktemp("site")
    (wheel,) = wheels.glob("*manylinux*_aarch64.whl")
    options = ["--quiet", "--target", site, "--only-binary=:all:", "--implementation=cp", f"--python-version={short}"]
    options += [f"--platform=manylinux_2_{n}_aarch64" for n in range(17, 37)]
    subprocess.run([sys.executable, "-m", "pip", "install", *options, wheel], check=True)

    def run(*arguments: str) -> str:
        environment = {"PATH": os.environ["PATH"], "PYTHONPATH": str(site), "HOME": str(site), "MPLBACKEND": "Agg"}
        done = subprocess.run(
            [*python, *arguments], env=environment, capture_output=True, text=True, cwd=site, timeout=1200
        )
        assert done.returncode == 0, done.stderr[-2000:]
        return done.stdout

    return run


def test_kernels_come_from_the_wheel(arm):
    code = """
import platform, sys
from sheldrake.common._native import prebuilt
found, why = prebuilt.library()
print(platform.machine(), why, len(found.entries) > 50, "llvmlite" in sys.modules)
"""
    assert arm("-c", code).split() == ["aarch64", "in", "use", "True", "False"]


def test_the_block_falls_as_here(arm, tmp_path):
    there, here = tmp_path / "there", tmp_path / "here"
    arm("-m", "sheldrake", "demo", "--headless", "--seconds", "1", "--out", str(there))
    command = [sys.executable, "-m", "sheldrake", "demo", "--headless", "--seconds", "1", "--out", str(here)]
    source = pathlib.Path(__file__).resolve().parents[2] / "src"
    subprocess.run(command, check=True, env={**os.environ, "PYTHONPATH": str(source)}, stdout=subprocess.DEVNULL)
    mine, theirs = (np.load(folder / "block.npz") for folder in (here, there))
    assert sorted(mine.files) == sorted(theirs.files)
    assert mine["data"].shape[1] > 1000 and np.ptp(mine["data"][6]) > 0.05
    np.testing.assert_allclose(theirs["data"], mine["data"], rtol=1e-8, atol=1e-9)
