"""Arrays on disk: made once for the same content, made anew when anything they depend on or they themselves change."""

import os
import pathlib

import numpy as np
import pytest

from sheldrake.common import cached_arrays as module
from sheldrake.common._native import disk_cache
from sheldrake.common.cached_arrays import cached_arrays
from sheldrake.geometry._compiled import hulls
from sheldrake.geometry._meshes import convex_hull

TRIPLE = np.arange(6.0).reshape(2, 3), np.array([1, -2], np.int64), np.zeros((0, 3), bool)


@pytest.fixture
def folder(tmp_path, monkeypatch):
    monkeypatch.setenv("SHELDRAKE_CACHE_DIR", str(tmp_path / "caches"))
    disk_cache.prune.cache_clear()
    module._hash_of.cache_clear()
    return tmp_path / "caches" / "arrays"


class Maker:
    """Counts how often arrays are made."""

    calls = 0

    def __call__(self):
        self.calls += 1
        return TRIPLE


def ask(made_of=(b"a", b"bc"), made_by=(__file__,)):
    """What is kept, and whether it was made for this question."""
    make = Maker()
    found = cached_arrays("triple", made_by, made_of, make)
    assert all(a.dtype == b.dtype and a.shape == b.shape and (a == b).all() for a, b in zip(found, TRIPLE, strict=True))
    return bool(make.calls)


def test_what_was_made_is_found_again(folder):
    assert ask()
    assert not ask()
    assert len(list(folder.iterdir())) == 1


def test_other_content_is_made_anew(folder, tmp_path):
    assert ask()
    assert ask(made_of=(b"ab", b"c"))  # the same bytes, divided elsewhere
    source = tmp_path / "source.py"
    source.write_text("a")
    assert ask(made_by=(str(source),))
    assert not ask(made_by=(str(source),))
    source.write_text("b")
    module._hash_of.cache_clear()
    assert ask(made_by=(str(source),))


@pytest.mark.parametrize("damage", ["cut", "turned", "empty"])
def test_what_is_damaged_is_made_anew(folder, damage):
    ask()
    (file,) = folder.iterdir()
    data = bytearray(file.read_bytes())
    data[-1] ^= damage == "turned"
    file.write_bytes({"cut": data[:-3], "turned": data, "empty": b""}[damage])
    assert ask()
    assert not ask()


def test_files_that_others_may_write_are_not_read(folder):
    ask()
    (file,) = folder.iterdir()
    file.chmod(0o666)
    with pytest.warns(UserWarning, match="may be written by others"):
        assert ask()


def test_a_folder_that_cannot_be_made_costs_only_time(folder, monkeypatch):
    folder.parent.write_text("a file where the folder should be")
    disk_cache._warn_once.cache_clear()
    with pytest.warns(UserWarning, match="cannot be kept"):
        assert ask()
    assert ask()


def test_a_folder_keeps_what_was_read_last(folder, monkeypatch):
    for k in range(4):
        ask(made_of=(bytes([k]),))
    files = sorted(folder.iterdir())
    size = files[0].stat().st_size
    for age, file in enumerate(files):
        os.utime(file, (1e9, file.stat().st_mtime - 100.0 * age))
    monkeypatch.setattr(disk_cache, "MOST_IN_A_FOLDER", 2 * size)
    disk_cache.prune.cache_clear()
    disk_cache.prune(folder.parent)
    assert sorted(folder.iterdir()) == files[:2]
    os.utime(files[0], (1e9, 1e9))  # years ago
    disk_cache.prune.cache_clear()
    disk_cache.prune(folder.parent)
    assert list(folder.iterdir()) == files[1:2]


def mesh_file(folder: pathlib.Path, points) -> pathlib.Path:
    path = folder / "cloud.obj"
    path.write_text("".join("v {!r} {!r} {!r}\n".format(*p) for p in points.tolist()) + "f 1 2 3\n")
    return path


def test_hulls_and_cells_of_another_process_are_the_same(folder, tmp_path, monkeypatch):
    points = np.random.default_rng(3).normal(size=(300, 3))
    path = mesh_file(tmp_path, points)

    def hull():
        convex_hull._cached_hull.cache_clear()
        hulls._cells_of_bytes.cache_clear()
        mesh = convex_hull._cached_hull(path, 0, (1.0, 2.0, 1.0))
        return mesh, hulls._cells(mesh._vertices)

    def must_not(*args):
        raise AssertionError("made again")

    mesh, cells = hull()
    monkeypatch.setattr(convex_hull, "make_convex_hull", must_not)
    monkeypatch.setattr(hulls, "_make_cells", must_not)
    again, cells_again = hull()
    assert mesh.Equal(again)
    for a, b in zip(cells, cells_again, strict=True):
        np.testing.assert_array_equal(a, b)


def test_cells_begin_where_they_are_put():
    vertices = np.random.default_rng(4).normal(size=(200, 3))
    vertices /= np.linalg.norm(vertices, axis=1)[:, None]
    cells = hulls._make_cells(vertices)
    v0, at = 1000, 50
    moved = cells.from_index(v0, at)
    which = hulls.lowest_in_cells(vertices)
    for cell, may in enumerate(which):
        begin, end = moved[cell] - at, moved[cell + 1] - at
        found = moved[begin:end]
        if len(found) == 1 and found[0] < 0:
            parts = -found[0] - at
            num_parts = hulls.CELLS**2
            ends = moved[parts : parts + num_parts + 1] - at
            found = np.unique(moved[ends[0] : ends[-1]])
            assert set(found - v0) <= set(np.flatnonzero(may))
        else:
            np.testing.assert_array_equal(found - v0, np.flatnonzero(may))
