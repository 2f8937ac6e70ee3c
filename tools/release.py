"""Builds a release and checks it: `python dev.py release [OUT]`, by default into dist/.

Five wheels and the sdist; what is in each; and the wheel of this machine installed from the folder, without a compiler,
running the README's simulation and making a page of it. Says each thing that is wrong; nothing is uploaded.
"""

from __future__ import annotations

import os
import pathlib
import re
import subprocess
import sys
import tarfile
import tempfile
import venv
import zipfile

ROOT = pathlib.Path(__file__).resolve().parents[1]
IN_WHEEL = ("sheldrake/__init__.py", "sheldrake/all.pyi", "sheldrake/py.typed", "sheldrake/GUIDE.md",
            "sheldrake/models/two_hole_block/two_hole_block.urdf", "sheldrake/_prebuilt/kernels.json",
            "sheldrake/_prebuilt/wasm32.zip")  # fmt: skip
IN_SDIST = ("pyproject.toml", "README.md", "CHANGELOG.md", "CITATION.cff", "LICENSE", "hatch_build.py", "dev.py",
            "requirements.lock", "src/sheldrake/GUIDE.md", "tools/build_backend.py", "tests/conftest.py")  # fmt: skip
LARGEST = 40e6  # [byte] of a wheel


def version_faults(version: str, root: pathlib.Path = ROOT) -> list[str]:
    """What does not say the version of the release."""
    faults = []
    for name, line in (
        ("src/sheldrake/__init__.py", f'__version__ = "{version}"'),
        ("CITATION.cff", f"version: {version}"),
        ("CHANGELOG.md", f"## {version}"),
    ):
        if not re.search(rf"^{re.escape(line)}(?![\w.])", (root / name).read_text(encoding="utf-8"), re.MULTILINE):
            faults.append(f"{name} does not say {line!r}")
    if re.search(r"[a-z]", version):
        faults.append(f"{version} is no version of a release: change pyproject.toml")
    return faults


def wheel_faults(path: pathlib.Path, version: str) -> list[str]:
    """What is wrong with a wheel: its name, files that are missing, that do not belong there, its size."""
    faults = [] if path.name.startswith(f"sheldrake-{version}-py3-none-") else [f"is not of version {version}"]
    if path.name.endswith("-any.whl"):
        faults.append("has no prebuilt kernels: its platform is 'any'")
    with zipfile.ZipFile(path) as wheel:
        broken = wheel.testzip()
        names = set(wheel.namelist())
    faults += [f"{broken} is broken"] if broken else []
    faults += [f"lacks {name}" for name in IN_WHEEL if name not in names]
    if not any(re.fullmatch(r"sheldrake/_prebuilt/kernels\.(so|dylib|dll)", name) for name in names):
        faults.append("lacks the library of kernels")
    info = f"sheldrake-{version}.dist-info/"
    foreign = sorted(name for name in names if not name.startswith(("sheldrake/", info)) or "__pycache__" in name)
    faults += [f"has {foreign[0]} and {len(foreign) - 1} other files that do not belong there"] if foreign else []
    if path.stat().st_size > LARGEST:
        faults.append(f"has {path.stat().st_size / 1e6:.0f} MB, more than {LARGEST / 1e6:.0f}")
    return faults


def sdist_faults(path: pathlib.Path, version: str) -> list[str]:
    """What is wrong with an sdist: files that are missing, or that are made by building."""
    with tarfile.open(path) as sdist:
        names = {name.partition("/")[2] for name in sdist.getnames()}
    faults = [f"lacks {name}" for name in IN_SDIST if name not in names]
    made = sorted(name for name in names if re.search(r"_prebuilt/|__pycache__|^build/|^dist/", name))
    return faults + ([f"has {made[0]}, which is made by building"] if made else [])


def folder_faults(folder: pathlib.Path, version: str) -> list[str]:
    """What is wrong with a folder of distributions, each text with the file's name."""
    sys.path.insert(0, str(ROOT / "src"))
    from sheldrake.common._native.build import PLATFORMS

    wheels = sorted(folder.glob(f"sheldrake-{version}-*.whl"))
    faults = [f"{path.name}: {text}" for path in wheels for text in wheel_faults(path, version)]
    for platform in PLATFORMS.values():
        if not any(path.name.endswith(f"-{platform.wheel_tag}.whl") for path in wheels):
            faults.append(f"there is no wheel for {platform.wheel_tag}")
    sdist = folder / f"sheldrake-{version}.tar.gz"
    if not sdist.exists():
        return [*faults, f"there is no {sdist.name}"]
    return faults + [f"{sdist.name}: {text}" for text in sdist_faults(sdist, version)]


def installed_faults(folder: pathlib.Path) -> list[str]:
    """Installs from a folder of wheels where there is no compiler, runs the README's simulation, makes a page of it."""
    readme = (ROOT / "README.md").read_text(encoding="utf-8")
    (code,) = re.findall(r"```python\n(.*?)```", readme, re.DOTALL)
    code += "\nfrom sheldrake.export import SavePage\nSavePage(simulator, 'page.html')\n"
    expected = re.search(r"print\(.*\)  # (.*)", code).group(1)  # type: ignore[union-attr]
    with tempfile.TemporaryDirectory() as name:
        home = pathlib.Path(name)
        venv.create(home / "venv", with_pip=True)
        python = home / "venv" / ("Scripts/python.exe" if os.name == "nt" else "bin/python")
        environment = {key: value for key, value in os.environ.items() if key not in ("PYTHONPATH", "PYTHONHOME")}
        environment |= {"PATH": str(python.parent), "SHELDRAKE_CACHE_DIR": str(home / "cache"), "MPLBACKEND": "Agg"}
        pip = [str(python), "-m", "pip", "install", "--quiet", "--only-binary", ":all:"]
        # Ours alone from the folder: a registry may have another package of this name. Then what it needs.
        ours = [*pip, "--no-index", "--no-deps", "--find-links", str(folder), "sheldrake"]
        for command in (ours, [*pip, "sheldrake"], [str(python), "-c", code]):
            done = subprocess.run(command, env=environment, cwd=home, capture_output=True, text=True, check=False)
            if done.returncode != 0:
                return [f"{' '.join(command[:4])} ... fails: {done.stderr.strip()[-500:]}"]
        found = done.stdout.strip()
        cache = home / "cache"
        compiled = list(cache.rglob("*.o")) if cache.exists() else []
    faults = [] if found == expected else [f"README's code prints {found!r} instead of {expected!r}"]
    return faults + ([f"{len(compiled)} kernels were compiled at first use"] if compiled else [])


def main() -> int:
    """Builds, checks, and says what is wrong; returns 1 when something is."""
    folder = pathlib.Path(next((word for word in sys.argv[1:] if word[0] != "-"), ROOT / "dist")).resolve()
    version = re.search(r'^version = "(.*)"', (ROOT / "pyproject.toml").read_text(encoding="utf-8"), re.MULTILINE)[1]  # type: ignore[index]
    if "--check-only" not in sys.argv:
        subprocess.run([sys.executable, str(ROOT / "tools" / "build_wheels.py"), str(folder)], check=True)
    faults = version_faults(version) + folder_faults(folder, version) + installed_faults(folder)
    for text in faults:
        print(f"wrong: {text}", file=sys.stderr)
    print(f"sheldrake {version}: " + (f"{len(faults)} faults" if faults else f"{folder} can be released"))
    return int(bool(faults))


if __name__ == "__main__":
    sys.exit(main())
