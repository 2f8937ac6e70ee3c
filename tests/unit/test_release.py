"""What `python dev.py release` finds wrong with wheels, sdists and versions."""

import shutil
import tarfile
import zipfile

from tools import release

VERSION = "1.2.3"


def a_wheel(folder, leave_out=(), more=(), platform="win_amd64"):
    path = folder / f"sheldrake-{VERSION}-py3-none-{platform}.whl"
    names = [*release.IN_WHEEL, "sheldrake/_prebuilt/kernels.dll", f"sheldrake-{VERSION}.dist-info/METADATA", *more]
    with zipfile.ZipFile(path, "w") as wheel:
        for name in names:
            if name not in leave_out:
                wheel.writestr(name, "text")
    return path


def test_a_good_wheel_has_no_faults(tmp_path):
    assert release.wheel_faults(a_wheel(tmp_path), VERSION) == []


def test_faults_of_wheels_are_named(tmp_path):
    assert release.wheel_faults(a_wheel(tmp_path, ["sheldrake/GUIDE.md"]), VERSION) == ["lacks sheldrake/GUIDE.md"]
    assert release.wheel_faults(a_wheel(tmp_path, ["sheldrake/_prebuilt/kernels.dll"]), VERSION) == [
        "lacks the library of kernels"
    ]
    (fault,) = release.wheel_faults(a_wheel(tmp_path, more=["tests/test_a.py"]), VERSION)
    assert "tests/test_a.py" in fault
    (fault,) = release.wheel_faults(a_wheel(tmp_path, platform="any"), VERSION)
    assert "no prebuilt kernels" in fault
    assert release.wheel_faults(a_wheel(tmp_path), "1.2.4")[0] == "is not of version 1.2.4"


def test_faults_of_an_sdist_are_named(tmp_path):
    path = tmp_path / f"sheldrake-{VERSION}.tar.gz"
    (tmp_path / "file").write_text("text")
    names = [name for name in release.IN_SDIST if name != "LICENSE"]
    with tarfile.open(path, "w:gz") as sdist:
        for name in [*names, "src/sheldrake/_prebuilt/kernels.so"]:
            sdist.add(tmp_path / "file", f"sheldrake-{VERSION}/{name}")
    missing, made = release.sdist_faults(path, VERSION)
    assert missing == "lacks LICENSE" and "_prebuilt/kernels.so" in made


def test_versions_agree_and_one_that_does_not_is_named(tmp_path):
    (version,) = [line[11:-1] for line in (release.ROOT / "pyproject.toml").open() if line.startswith('version = "')]
    version = version.rstrip('"')
    assert release.version_faults(version) == []
    for name in ("CITATION.cff", "CHANGELOG.md", "src/sheldrake/__init__.py"):
        (tmp_path / name).parent.mkdir(parents=True, exist_ok=True)
        shutil.copy(release.ROOT / name, tmp_path / name)
    (tmp_path / "CITATION.cff").write_text("version: 0.0.9\n")
    assert release.version_faults(version, tmp_path) == [f"CITATION.cff does not say 'version: {version}'"]
    assert any("no version of a release" in fault for fault in release.version_faults("0.1.0.dev0", tmp_path))
