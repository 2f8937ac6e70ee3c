"""Machine code is read from folders that belong to the user alone, and workers import from nowhere else."""

import os
import pathlib
import subprocess
import sys

import numpy as np
import pytest

from sheldrake.common._native import parallel, prebuilt, private_files, store
from sheldrake.common.kernel import Vector, jit_enabled, kernel
from sheldrake.multibody.plant._kernels.step import next_state
from sheldrake.multibody.tree._kernels.queries import calc_gravity, calc_kinetic_energy

pytestmark = pytest.mark.skipif(os.name == "nt", reason="asks for owners and modes as POSIX has them")
native_only = pytest.mark.skipif(not jit_enabled(), reason="asks about machine code; SHELDRAKE_JIT=0 switches it off")


@pytest.fixture(autouse=True)
def afresh(monkeypatch):
    """Each test hears each warning."""
    private_files._refuse.cache_clear()
    monkeypatch.setenv("SHELDRAKE_PREBUILT", "0")


@kernel(top=True)
def thrice(x: Vector) -> None:
    for i in range(len(x)):
        x[i] = 3.0 * x[i]


@kernel(top=True)
def five_times(x: Vector) -> None:
    for i in range(len(x)):
        x[i] = 5.0 * x[i]


@pytest.mark.parametrize("value", ["", "cache", "./cache", "../x"])
@pytest.mark.parametrize("variable", ["SHELDRAKE_CACHE_DIR", "XDG_CACHE_HOME"])
def test_a_variable_that_is_empty_or_relative_counts_as_unset(monkeypatch, tmp_path, variable, value):
    for name in ("SHELDRAKE_CACHE_DIR", "XDG_CACHE_HOME"):
        monkeypatch.delenv(name, raising=False)
    monkeypatch.setenv("HOME", str(tmp_path))
    unset = store.cache_folder()
    assert unset.is_relative_to(tmp_path)
    monkeypatch.setenv(variable, value)
    assert store.cache_folder() == unset


@pytest.mark.parametrize("home", [None, "", "here"])
def test_without_a_home_the_operating_system_is_asked(monkeypatch, home):
    import pwd

    for name in ("SHELDRAKE_CACHE_DIR", "XDG_CACHE_HOME", "HOME"):
        monkeypatch.delenv(name, raising=False)
    if home is not None:
        monkeypatch.setenv("HOME", home)
    assert store.cache_folder().is_relative_to(pwd.getpwuid(os.getuid()).pw_dir)

    def nobody(number):
        raise KeyError(number)

    monkeypatch.setattr(pwd, "getpwuid", nobody)
    assert store.cache_folder().is_absolute()


def kept(folder, content=b"code"):
    path = folder / "sheldrake" / "abi" / "k.o"
    private_files.write(path, content)
    return path


def test_what_is_written_is_the_users_alone_whatever_the_umask(tmp_path):
    before = os.umask(0)
    try:
        path = kept(tmp_path / "a" / "b")
    finally:
        os.umask(before)
    for place in (path, *list(path.parents)[:4]):
        assert place.stat().st_mode & 0o077 == 0
    assert private_files.read(path) == b"code"


@pytest.mark.parametrize("bits", [0o020, 0o002])
@pytest.mark.parametrize("up", [0, 1, 2])
def test_what_others_may_write_is_refused_with_one_line(tmp_path, up, bits):
    path = kept(tmp_path)
    place = [path, *path.parents][up]
    place.chmod(place.stat().st_mode | bits)
    with pytest.warns(
        UserWarning, match=f"Compiled kernels and hulls in {place} are not used: it may be written by others"
    ) as w:
        assert private_files.read(path) is None
    assert len(w) == 1
    assert private_files.is_trusted(path.parent) == (up == 0)


@pytest.mark.parametrize("up", [0, 1, 2])
def test_what_belongs_to_somebody_else_is_refused(tmp_path, monkeypatch, up):
    path = kept(tmp_path)
    if os.geteuid() == 0:
        os.chown([path, *path.parents][up], 12345, 12345)
    else:
        monkeypatch.setattr(os, "geteuid", lambda: 12345)
    with pytest.warns(UserWarning, match="not to you"):
        assert private_files.read(path) is None


def test_what_is_no_regular_file_of_moderate_size_is_refused(tmp_path, monkeypatch):
    path = kept(tmp_path)
    fifo = path.with_name("fifo.o")
    os.mkfifo(fifo, 0o600)
    with pytest.warns(UserWarning, match="no regular file"):
        assert private_files.read(fifo) is None  # at once: nobody writes to it
    zero = path.with_name("zero.o")
    zero.symlink_to("/dev/zero")
    with pytest.warns(UserWarning, match="is a link"):
        assert private_files.read(zero) is None
    with open(path, "r+b") as file:
        file.truncate(private_files.MOST + 1)
    with pytest.warns(UserWarning, match="bytes"):
        assert private_files.read(path) is None


def test_a_full_disk_leaves_no_file_behind(tmp_path, monkeypatch):
    def full(*args):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(os, "replace", full)
    with pytest.raises(OSError, match="No space"):
        kept(tmp_path)
    assert [p for p in tmp_path.rglob("*") if p.is_file()] == []


@pytest.mark.parametrize("text", ["[]", "3", "null", '"a"', "{", '{"sources": 3}', '{"sources": {}, "sha256": 4}'])
def test_a_manifest_that_is_none_is_named(tmp_path, monkeypatch, text):
    (tmp_path / "kernels.json").write_text(text)
    (tmp_path / f"kernels{prebuilt.ENDING}").write_bytes(b"no library")
    monkeypatch.setattr(prebuilt, "FOLDER", tmp_path)
    monkeypatch.delenv("SHELDRAKE_PREBUILT")
    monkeypatch.setenv("SHELDRAKE_BOUNDSCHECK", "0")
    found, reason = prebuilt.library.__wrapped__()
    assert found is None
    assert "damaged" in reason or "other sources" in reason


@native_only
def test_a_refused_folder_costs_time_alone(tmp_path, monkeypatch):
    monkeypatch.setenv("SHELDRAKE_CACHE_DIR", str(tmp_path))
    tmp_path.chmod(0o777)
    with pytest.warns(UserWarning, match="may be written by others"):
        assert thrice.native(x := np.ones(2)) == 0
    assert x.tolist() == [3.0, 3.0]
    assert not store.is_writable()
    assert list(tmp_path.rglob("*.o")) == []


@native_only
def test_workers_do_not_import_from_the_current_folder(tmp_path, monkeypatch):
    trap, cache = tmp_path / "trap", tmp_path / "cache"
    trap.mkdir()
    for name in ("llvmlite.py", "numpy.py", "json.py", "sheldrake.py"):
        (trap / name).write_text(f"open({str(tmp_path / 'sprung')!r}, 'w')\nraise SystemExit\n")
    monkeypatch.setenv("SHELDRAKE_CACHE_DIR", str(cache))
    monkeypatch.chdir(trap)
    kernels = [next_state, calc_gravity, calc_kinetic_energy]
    for k in kernels:
        monkeypatch.delitem(k.__dict__, "_native", raising=False)
    queue = parallel._queue(len(kernels))
    worker = parallel._start(kernels, queue)
    os.close(queue)
    assert worker.wait(120) == 0
    assert not (tmp_path / "sprung").exists()
    assert len(list(cache.rglob("*.o"))) == len(kernels)


THREADS = """
import threading
import numpy as np
from tests.unit.common.test_private_files import five_times, thrice
from sheldrake.multibody.tree._kernels.queries import calc_gravity, calc_kinetic_energy
start, found = threading.Barrier(8), [None] * 8
def work(k):
    x = np.arange(5.0)
    start.wait()
    for kernel in (thrice, five_times)[:: 1 - 2 * (k % 2)]:
        assert kernel.bind(x)() == 0
    found[k] = x
    calc_kinetic_energy.address, calc_gravity.address
threads = [threading.Thread(target=work, args=(k,)) for k in range(8)]
[t.start() for t in threads]
[t.join() for t in threads]
assert all(np.array_equal(x, 15.0 * np.arange(5.0)) for x in found), found
"""
ONE_BY_ONE = """
from tests.unit.common.test_private_files import five_times, thrice
from sheldrake.multibody.tree._kernels.queries import calc_gravity, calc_kinetic_energy
thrice.address, five_times.address, calc_kinetic_energy.address, calc_gravity.address
"""


@native_only
def test_eight_threads_that_compile_make_the_objects_that_one_makes(tmp_path):
    found = []
    for name, script in (("eight", THREADS), ("one", ONE_BY_ONE)):
        environment = {
            **os.environ,
            "SHELDRAKE_CACHE_DIR": str(tmp_path / name),
            "SHELDRAKE_QUIET": "1",
            "PYTHONPATH": os.pathsep.join(os.path.abspath(p) for p in sys.path),
        }
        done = subprocess.run([sys.executable, "-c", script], env=environment, capture_output=True, text=True)
        assert (done.returncode, done.stderr) == (0, "")
        found.append({p.name: p.read_bytes() for p in pathlib.Path(tmp_path, name).rglob("*.o")})
    assert len(found[0]) == 4
    assert found[0] == found[1]


def test_a_folder_that_is_exchanged_after_the_look_at_it_is_refused(tmp_path, monkeypatch):
    path = kept(tmp_path)
    monkeypatch.setattr(private_files, "is_trusted", lambda folder: True)  # as it was when it was looked at
    assert private_files.read(path) == b"code"
    path.parent.chmod(0o777)
    with pytest.warns(UserWarning, match="may be written by others"):
        assert private_files.read(path) is None


def test_a_link_to_code_elsewhere_is_not_followed(tmp_path):
    path = kept(tmp_path)
    path.rename(tmp_path / "other.o")
    path.symlink_to(tmp_path / "other.o")
    with pytest.warns(UserWarning, match="is a link"):
        assert private_files.read(path) is None
