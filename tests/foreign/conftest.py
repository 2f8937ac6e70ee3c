"""Wheels of other platforms, run here under emulators: `python dev.py foreign`.

Not part of the ordinary tests: it builds every wheel and needs Debian's qemu-user and wine64.
"""

from __future__ import annotations

import os
import pathlib
import re
import shutil
import subprocess
import sys

import pytest

ROOT = pathlib.Path(__file__).resolve().parents[2]


@pytest.fixture(scope="session")
def wheels(tmp_path_factory):
    """The folder with all platforms' wheels, and libraries in `prebuilt`: built now, or that of SHELDRAKE_WHEELS."""
    if "SHELDRAKE_WHEELS" in os.environ:
        return pathlib.Path(os.environ["SHELDRAKE_WHEELS"])
    out = tmp_path_factory.mktemp("wheels")
    subprocess.run([sys.executable, ROOT / "tools" / "build_wheels.py", out], check=True, cwd=ROOT)
    shutil.copytree(ROOT / "build" / "prebuilt", out / "prebuilt")
    return out


@pytest.fixture(scope="session")
def driver(tmp_path_factory):
    """Makes the program that runs a case of spans.py, for a target of zig."""

    def make(target: str, ending: str = "") -> pathlib.Path:
        program = tmp_path_factory.mktemp("driver") / f"driver{ending}"
        source = pathlib.Path(__file__).with_name("span_driver.c")
        command = [sys.executable, "-m", "ziglang", "cc", "-target", target, "-O1", "-o", program, source]
        subprocess.run([*command, *([] if ending else ["-ldl"])], check=True)
        return program

    return make


class ArmPython:
    """A Python for ARM, run by qemu."""

    def __init__(self, root):
        self._command = ["qemu-aarch64", "-L", str(root), str(root / "usr/bin/python3")]
        version = subprocess.run([*self._command, "-V"], capture_output=True, text=True, check=True).stdout
        (self._version,) = re.findall(r"3\.\d+", version)

    def install(self, site, *what):
        """Puts packages into a folder, as pip does."""
        options = ["--quiet", "--target", site, "--only-binary=:all:", "--implementation=cp"]
        options += [f"--python-version={self._version}"]
        options += [f"--platform=manylinux_2_{n}_aarch64" for n in range(17, 37)]
        subprocess.run([sys.executable, "-m", "pip", "install", *options, *what], check=True)

    def run(self, site, *arguments):
        """What it prints, with that folder."""
        environment = {"PATH": os.environ["PATH"], "PYTHONPATH": str(site), "HOME": str(site), "MPLBACKEND": "Agg"}
        command = [*self._command, *map(str, arguments)]
        done = subprocess.run(command, env=environment, capture_output=True, text=True, cwd=site, timeout=1200)
        assert done.returncode == 0, done.stderr[-2000:]
        return done.stdout


ARM_TOOLS = ("qemu-aarch64", "apt-get", "dpkg-deb")


@pytest.fixture(scope="session")
def arm_python(tmp_path_factory):
    """Debian's Python for ARM, fetched beside the system's own packages."""
    if not all(map(shutil.which, ARM_TOOLS)):
        pytest.skip(f"needs {', '.join(ARM_TOOLS)} (Debian: apt install qemu-user)")
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
    return ArmPython(folder)
