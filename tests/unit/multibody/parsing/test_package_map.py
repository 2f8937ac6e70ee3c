"""PackageMap: adding, searching, resolving, refusing."""

import hashlib
import io
import json
import logging
import tarfile

import pytest

from sheldrake.common.deprecation import DrakeDeprecationWarning
from sheldrake.multibody.parsing import PackageMap
from sheldrake.multibody.parsing._files import remote_package
from sheldrake.multibody.parsing._files.diagnostics import DiagnosticPolicy, Location, ParseError
from sheldrake.multibody.parsing._files.package_map import resolve_uri


@pytest.fixture
def tree(tmp_path):
    """Two packages, one inside the other, and one behind an ignore marker."""
    for folder, name in [("one", "first"), ("one/inner", "second"), ("skipped/pkg", "third")]:
        (tmp_path / folder).mkdir(parents=True)
        (tmp_path / folder / "package.xml").write_text(f"<package><name> {name} </name></package>")
    (tmp_path / "skipped" / "COLCON_IGNORE").touch()
    (tmp_path / "one" / "mesh.obj").touch()
    return tmp_path


def empty():
    return PackageMap.MakeEmpty()


def test_add_get_contains_remove(tree):
    packages = empty()
    packages.Add("p", tree)
    packages.Add(package_name="p", package_path=str(tree) + "/one/..")  # the same folder again
    assert packages.Contains("p") and packages.size() == 1
    assert packages.GetPackageNames() == ["p"]
    assert packages.GetPath("p") == str(tree)
    packages.Remove("p")
    assert not packages.Contains("p")


def test_errors_name_the_package_and_the_known_ones(tree):
    packages = empty()
    packages.Add("p", tree)
    with pytest.raises(RuntimeError, match=r"'/nope'.*does not exist"):
        packages.Add("q", "/nope")
    with pytest.raises(RuntimeError, match="'p' is already known"):
        packages.Add("p", tree / "one")
    with pytest.raises(RuntimeError, match="unknown package 'q'; the known packages are p"):
        packages.GetPath("q")
    with pytest.raises(RuntimeError, match="unknown package 'q'"):
        packages.Remove("q")


def test_add_map_is_all_or_nothing(tree):
    one, other = empty(), empty()
    one.Add("b", tree)
    other.Add("a", tree)
    other.Add("b", tree / "one")
    with pytest.raises(RuntimeError, match="'b'"):
        one.AddMap(other)
    assert one.GetPackageNames() == ["b"]
    other.Remove("b")
    one.AddMap(other)
    assert one.GetPackageNames() == ["a", "b"]


def test_copies_are_independent(tree):
    one = empty()
    one.Add("a", tree)
    copy = PackageMap(one)
    copy.Remove("a")
    assert one.Contains("a")


def test_folder_search_finds_nested_packages(tree):
    packages = empty()
    packages.PopulateFromFolder(tree)
    assert packages.GetPackageNames() == ["first", "second", "third"]
    assert packages.GetPath("second") == str(tree / "one" / "inner")


def test_ros_search_stops_at_packages_and_markers(tree, monkeypatch):
    monkeypatch.setenv("ROS_PACKAGE_PATH", f"{tree}:/nope")
    packages = empty()
    packages.PopulateFromRosPackagePath()
    assert packages.GetPackageNames() == ["first"]
    with pytest.raises(RuntimeError, match="PopulateFromRosPackagePath"):
        packages.PopulateFromEnvironment("ROS_PACKAGE_PATH")


def test_upward_search_is_retired(tree):
    packages = empty()
    with pytest.warns(DrakeDeprecationWarning, match="PopulateUpstreamToDrake.*retired"):
        packages.PopulateUpstreamToDrake(tree / "one" / "inner" / "robot.urdf")
    assert packages.GetPackageNames() == ["first", "second"]


def test_environment_search(tree, monkeypatch, caplog):
    monkeypatch.setenv("MY_PATHS", f"{tree / 'one'}:/nope")
    packages = empty()
    with caplog.at_level(logging.WARNING):
        packages.PopulateFromEnvironment("MY_PATHS")
    assert packages.GetPackageNames() == ["first", "second"]
    assert "/nope" in caplog.text


def test_a_found_conflict_keeps_the_old_folder(tree, caplog):
    packages = empty()
    packages.Add("first", tree)
    packages.PopulateFromFolder(tree / "one")
    assert packages.GetPath("first") == str(tree)
    assert "'first'" in caplog.text


def test_package_xml(tree):
    packages = empty()
    packages.AddPackageXml(filename=tree / "one" / "package.xml")
    assert packages.GetPath("first") == str(tree / "one")
    with pytest.raises(RuntimeError, match="cannot be read"):
        packages.AddPackageXml(tree / "package.xml")
    (tree / "package.xml").write_text("<package/>")
    with pytest.raises(RuntimeError, match="<name>"):
        packages.AddPackageXml(tree / "package.xml")


def test_addresses_resolve_to_existing_files(tree):
    packages = empty()
    packages.Add("first", tree / "one")
    mesh = str(tree / "one" / "mesh.obj")
    assert packages.ResolveUrl("package://first/mesh.obj") == mesh
    assert packages.ResolveUrl("model://first/inner/../mesh.obj") == mesh
    assert packages.ResolveUrl(f"file://{mesh}") == mesh


@pytest.mark.parametrize(
    ("url", "message"),
    [
        ("package://first/none.obj", "resolved to '.*none.obj' which does not exist"),
        ("package://other/mesh.obj", "unknown package 'other'.*Known packages: first"),
        ("package://first/../one/mesh.obj/../../../etc", "leaves its package"),
        ("http://first/mesh.obj", "unsupported scheme"),
        ("mesh.obj", "relative path"),
    ],
)
def test_bad_addresses_are_explained(tree, url, message):
    packages = empty()
    packages.Add("first", tree / "one")
    with pytest.raises(RuntimeError, match=message):
        packages.ResolveUrl(url)


def resolve(uri, folder):
    return resolve_uri(uri, empty(), str(folder), Location("robot.urdf", 3, 1), DiagnosticPolicy())


def test_a_missing_package_is_found_above_the_model(tree):
    (tree / "one" / "urdf").mkdir()
    assert resolve("package://first/mesh.obj", tree / "one" / "urdf") == str(tree / "one" / "mesh.obj")  # package.xml
    assert resolve("package://one/mesh.obj", tree / "one" / "urdf") == str(tree / "one" / "mesh.obj")  # folder name
    assert resolve("package://one/mesh.obj", tree / "skipped") == str(tree / "one" / "mesh.obj")  # beside a parent
    with pytest.raises(ParseError, match=r"robot\.urdf:3:1: error: .*Looked above") as caught:
        resolve("package://absent/mesh.obj", tree / "one")
    assert str(tree / "absent") in str(caught.value)


def test_remote_packages_are_checked_and_unpacked_once(tmp_path, monkeypatch):
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    archive = tmp_path / "models.tar.gz"
    with tarfile.open(archive, "w:gz") as file:
        info = tarfile.TarInfo("models-1/box.urdf")
        info.size = 8
        file.addfile(info, io.BytesIO(b"<robot/>"))
    digest = hashlib.sha256(archive.read_bytes()).hexdigest()
    params = PackageMap.RemoteParams(urls=[f"file://{archive}"], sha256=digest, strip_prefix="models-1")
    packages = empty()
    packages.AddRemote(package_name="models", params=params)
    path = packages.ResolveUrl("package://models/box.urdf")
    archive.unlink()
    again = empty()
    again.AddRemote("models", params)
    assert again.ResolveUrl("package://models/box.urdf") == path  # from the cache

    bad = PackageMap.RemoteParams(urls=[f"file://{tmp_path}/none.zip"], sha256="0" * 64)
    packages.AddRemote("bad", bad)
    with pytest.raises(RuntimeError, match="'bad' could not be downloaded"):
        packages.GetPath("bad")


@pytest.mark.parametrize(
    "fields",
    [
        {"urls": [], "sha256": "0" * 64},
        {"urls": ["ftp://x/y.zip"], "sha256": "0" * 64},
        {"urls": ["https://x/y.zip"], "sha256": "0"},
        {"urls": ["https://x/y.zip"], "sha256": "0" * 64, "archive_type": "rar"},
    ],
)
def test_bad_remote_parameters(fields):
    with pytest.raises(RuntimeError, match=r"AddRemote\(\): package 'p'"):
        empty().AddRemote("p", PackageMap.RemoteParams(**fields))


def test_networking_can_be_switched_off(monkeypatch, tmp_path):
    monkeypatch.setenv("DRAKE_ALLOW_NETWORK", "none")
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    packages = empty()
    packages.AddRemote("p", PackageMap.RemoteParams(urls=["https://example.invalid/p.zip"], sha256="0" * 64))
    with pytest.raises(RuntimeError, match="DRAKE_ALLOW_NETWORK"):
        packages.GetPath("p")


def test_a_default_map_knows_drakes_models():
    assert PackageMap().Contains("drake_models")
    assert empty().size() == 0


def test_models_that_drake_has_fetched_are_not_fetched_again(monkeypatch, tmp_path):
    """Its cache names folders by the sums of archive and prefix; which models it points to, its resources say."""
    monkeypatch.setenv("DRAKE_ALLOW_NETWORK", "none")
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    root, prefix, sha256 = tmp_path / "drake_root" / "drake", "models-1", "1" * 64
    (root / "multibody" / "parsing").mkdir(parents=True)
    said = {"urls": ["https://example.invalid/models-1.tar.gz"], "sha256": sha256, "strip_prefix": prefix, "name": "x"}
    (root / "multibody" / "parsing" / "drake_models.json").write_text(json.dumps(said))
    monkeypatch.setenv("DRAKE_RESOURCE_ROOT", str(root.parent))
    with pytest.raises(RuntimeError, match=r"example\.invalid.*switched off by DRAKE_ALLOW_NETWORK"):
        PackageMap().GetPath("drake_models")
    folder = tmp_path / "drake" / "package_map" / f"{sha256}-{hashlib.sha256(prefix.encode()).hexdigest()}"
    folder.mkdir(parents=True)
    assert PackageMap().GetPath("drake_models") == str(folder)


def test_an_empty_list_of_who_may_use_the_network_is_none(monkeypatch):
    monkeypatch.setenv("DRAKE_ALLOW_NETWORK", "")
    assert remote_package._network_allowed()
    monkeypatch.setenv("DRAKE_ALLOW_NETWORK", "meshcat")
    assert not remote_package._network_allowed()
