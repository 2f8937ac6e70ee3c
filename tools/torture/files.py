"""Files that are damaged, cut, in the way or too large for the disk: saved contexts, results, compiled kernels."""

from __future__ import annotations

import contextlib
import functools
import io
import json
import os
import pathlib
import random
import resource
import shutil
import signal
import struct
import sys
import tempfile
import warnings
import zlib
from collections.abc import Iterator
from typing import Any

import numpy as np
from tests.unit.systems.framework.saved_run import build
from tools.torture.meshes import damage

from sheldrake.common._native import disk_cache, private_files, store
from sheldrake.common.kernel import Vector, kernel
from sheldrake.common.yaml import yaml_dump
from sheldrake.systems.analysis import Simulator
from sheldrake.systems.framework import LoadContext, SaveContext
from sheldrake.systems.primitives import LogSet, ReadLogs, StreamLogs
from sheldrake.systems.primitives._log_files import MAGIC

STRANGE_WORDS = (-1, 0, 1, 2, 7, 2**31, 2**40, 2**62, -(2**63), 2**63 - 1)
STRANGE_NUMBERS = (np.nan, np.inf, -np.inf, 1e300, -1e300, 5e-324, -0.0, 1e17)
STRANGE = (None, 3, -1, "x", [], [1], [[1]], {}, {"a": 1}, 1e400, True, {"plain": 1}, {"array": 0}, {"array": 10**9})


@functools.cache
def _folder() -> pathlib.Path:
    return pathlib.Path(tempfile.mkdtemp(prefix="torture-"))


# ---- saved contexts


@functools.cache
def _scene() -> tuple[Any, Any, bytes, dict[str, np.ndarray]]:
    """A diagram, a context in the middle of a run, its file, the arrays in that."""
    diagram, path = build(), _folder() / "good.npz"
    simulator = Simulator(diagram)
    simulator.AdvanceTo(0.3)
    SaveContext(simulator.get_context(), path)
    with np.load(path) as found:
        return diagram, simulator.get_context(), path.read_bytes(), dict(found)


def _take(data: bytes) -> None:
    """Loads a file: a context that can be stepped, or a RuntimeError that says what is wrong."""
    path = _folder() / "bad.npz"
    path.write_bytes(data)
    diagram = _scene()[0]
    try:
        context = LoadContext(diagram, path)
    except RuntimeError as error:
        assert "LoadContext()" in str(error)
        return
    t = context.get_time()
    try:
        Simulator(diagram, context).AdvanceTo(t + 0.005)
    except RuntimeError as error:
        assert str(error)


def cut_contexts(chance: random.Random, number: int) -> None:
    """A saved context that ends early: at every byte of it."""
    data = _scene()[2]
    _take(data[: number % len(data)])


def changed_contexts(chance: random.Random, number: int) -> None:
    """A saved context with other bytes, other numbers in its arrays, or other words in its description."""
    _, _, data, arrays = _scene()
    if chance.random() < 0.3:
        changed = bytearray(data)
        for _ in range(chance.randint(1, 8)):
            changed[chance.randrange(len(changed))] = chance.randrange(256)
        return _take(bytes(changed))
    arrays = {name: a.copy() for name, a in arrays.items()}
    for _ in range(chance.randint(1, 4)):
        name = chance.choice(["S", "S", "I", "I", "L", "meta", "meta", "size"])
        if name == "meta":
            arrays["meta"] = np.array(json.dumps(_changed(chance, json.loads(str(arrays["meta"])))))
        elif name == "size":
            name = chance.choice(["S", "I", "L"])
            arrays[name] = np.resize(
                arrays[name], chance.choice([0, 1, max(0, len(arrays[name]) - 1), len(arrays[name]) + 1])
            )
        elif len(arrays[name]):
            at = chance.randrange(len(arrays[name]))
            if name == "I" or chance.random() < 0.4:
                arrays[name].view(np.int64)[at] = chance.choice(STRANGE_WORDS)
            else:
                arrays[name][at] = chance.choice(STRANGE_NUMBERS)
    _take(_archive(arrays))


def _changed(chance: random.Random, value: Any) -> Any:
    """A tree of JSON with another leaf or branch somewhere."""
    if isinstance(value, dict) and value and chance.random() < 0.9:
        key = chance.choice(list(value))
        return {**value, key: _changed(chance, value[key])}
    if isinstance(value, list) and value and chance.random() < 0.8:
        at = chance.randrange(len(value))
        return [*value[:at], _changed(chance, value[at]), *value[at + chance.choice((1, 1, 1, 2)) :]]
    return chance.choice(STRANGE)


# ---- logs


@functools.cache
def _logs() -> dict[str, bytes]:
    """A log in a file of each kind that ReadLogs() reads."""
    diagram, context, _, _ = _scene()
    log, folder = diagram.GetSubsystemByName("plant log").FindLog(context), _folder()
    log.ToCsv(folder / "a.csv"), log.ToNpz(folder / "a.npz"), log.ToParquet(folder / "a.parquet")
    LogSet({"one": log, "two": log}).ToNpz(folder / "b.npz")
    simulator = Simulator(diagram)
    with StreamLogs(simulator, folder / "a.log"):
        simulator.AdvanceTo(0.1)
    return {name: (folder / name).read_bytes() for name in ("a.csv", "a.npz", "b.npz", "a.parquet", "a.log")}


def damaged_logs(chance: random.Random, number: int) -> None:
    """A file of logs that is cut, or has other bytes, arrays or words: whole samples, or an error that names it."""
    name, data = chance.choice(list(_logs().items()))
    if chance.random() < 0.3:
        data = data[: chance.randrange(len(data))]
    elif name.endswith(".npz") and chance.random() < 0.7:
        with np.load(io.BytesIO(data)) as found:
            arrays = dict(found)
        strange = (np.zeros((2, 3)), np.array(7.0), np.array(["x"]), np.zeros(0), np.array([np.nan, np.inf]), "x")
        arrays[chance.choice(list(arrays))] = chance.choice(strange)
        if chance.random() < 0.2:
            del arrays[chance.choice(list(arrays))]
        data = _archive(arrays)
    elif name == "a.log" and chance.random() < 0.5:
        begin = len(MAGIC) + 8
        end = begin + struct.unpack_from("<I", data, len(MAGIC))[0]
        text = json.dumps(_changed(chance, json.loads(data[begin:end]))).encode()
        data = data[: begin - 8] + struct.pack("<II", len(text), zlib.crc32(text)) + text + data[end:]
    else:
        data = damage(chance, data)
    path = _folder() / f"bad-{name}"
    path.write_bytes(data)
    try:
        logs = ReadLogs(path)
    except ValueError as error:
        assert str(path) in str(error)
        return
    for log in logs.values():
        assert log.data().shape == (len(log.names()), len(log.sample_times()))
        assert len(log.units()) == len(log.names())


def _archive(arrays: dict[str, np.ndarray]) -> bytes:
    stream = io.BytesIO()
    np.savez(stream, **arrays)
    return stream.getvalue()


# ---- a full disk


@contextlib.contextmanager
def full_disk(room: int) -> Iterator[None]:
    """Files take no more bytes than `room`."""
    before = resource.getrlimit(resource.RLIMIT_FSIZE)
    ignored = signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
    resource.setrlimit(resource.RLIMIT_FSIZE, (room, before[1]))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, before)
        signal.signal(signal.SIGXFSZ, ignored)


def _writers() -> dict[str, Any]:
    diagram, context, _, _ = _scene()
    log = diagram.GetSubsystemByName("plant log").FindLog(context)
    return {
        "a.npz": lambda path: SaveContext(context, path),
        "a.csv": log.ToCsv,
        "b.npz": log.ToNpz,
        "a.yaml": lambda path: yaml_dump({"a": list(range(3000))}, filename=str(path)),
        "a.o": lambda path: private_files.write(path, bytes(10_000)),
    }


def full_disks(chance: random.Random, number: int) -> None:
    """A file over another on a disk with room for some of it: the new one whole, or the old one and an error."""
    name, write = chance.choice(list(_writers().items()))
    folder = _folder() / "full"
    folder.mkdir(exist_ok=True)
    path, old = folder / name, b"as it was"
    if chance.random() < 0.8:
        path.write_bytes(old)
    size = _sizes(name)
    room = chance.choice([0, 1, chance.randrange(size), size - 1, size, 2 * size])
    try:
        with full_disk(room):
            write(path)
    except OSError:
        assert not path.exists() or path.read_bytes() == old, f"{name} is cut at {room} bytes"
        assert room < size, f"{name} has room and is not written"
    else:
        assert path.stat().st_size == size, f"{name} has {path.stat().st_size} bytes of {size}, without an error"
    left = [p.name for p in folder.iterdir() if p != path]
    shutil.rmtree(folder)
    assert not left, f"{left} are left behind"


@functools.cache
def _sizes(name: str) -> int:
    path = _folder() / f"size-{name}"
    _writers()[name](path)
    return path.stat().st_size


# ---- compiled kernels


@kernel(top=True)
def thrice(x: Vector) -> None:
    """Something small to compile."""
    for i in range(len(x)):
        x[i] = 3.0 * x[i]


@functools.cache
def _code() -> tuple[bytes, bytes]:
    """The file of a compiled kernel, and the code in it."""
    os.environ["SHELDRAKE_CACHE_DIR"] = str(_folder() / "good")
    code = store.make(thrice, tell=False)
    return store._path(thrice).read_bytes(), code


def caches(chance: random.Random, number: int) -> None:
    """A folder of compiled kernels that somebody damaged: what is read from it is whole, what is computed right."""
    data, code = _code()
    folder = pathlib.Path(tempfile.mkdtemp(dir=_folder()))
    os.environ["SHELDRAKE_CACHE_DIR"] = str(folder)
    path = store._path(thrice)
    path.parent.mkdir(parents=True, mode=0o700)
    kind = chance.choice(
        "cut cut bytes bytes swapped fifo zero folder link elsewhere exchanged mode owner huge".split()
    )
    wrong = bytearray(data[: number % len(data)] if kind == "cut" else data)
    if kind == "bytes":
        for _ in range(chance.randint(1, 4)):
            at = chance.randrange(len(wrong))
            wrong[at] ^= chance.randrange(1, 256)
    elif kind == "swapped":
        wrong = bytearray(bytes(32) + chance.randbytes(200))
    if kind == "fifo":
        os.mkfifo(path, 0o600)
    elif kind == "zero":
        path.symlink_to("/dev/zero")
    elif kind == "folder":
        path.mkdir()
    elif kind == "link":
        path.symlink_to(path)
    elif kind == "elsewhere":  # whole code of this user, in a place that others may have chosen
        (folder / "other.o").write_bytes(data)
        path.symlink_to(folder / "other.o")
    else:
        path.write_bytes(wrong)
        path.chmod(0o602 if kind == "mode" else 0o600)
    if kind == "mode" and chance.random() < 0.5:
        path.chmod(0o600)
        chance.choice([path.parent, path.parent.parent]).chmod(0o777)
    elif kind == "owner" and os.geteuid() == 0:
        os.chown(chance.choice([path, path.parent, path.parent.parent]), 12345, 12345)
    elif kind == "huge":
        os.truncate(path, private_files.MOST + 1 + chance.randrange(10**9))
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        if kind == "exchanged":  # after the look at the folder, before the file is opened
            path.parent.chmod(0o777)
            with contextlib.suppress(PermissionError):
                os.close(private_files._open(path))
                raise AssertionError("a file is opened in a folder that became another's")
        found = disk_cache.read(path)
        is_right = found == code and bytes(wrong) == data
        assert found is None or (is_right and kind not in ("mode", "huge", "elsewhere", "exchanged")), kind
        if number % 20 == 0:
            thrice.__dict__.pop("_native", None)
            assert thrice.native(x := np.ones(2)) == 0
            assert x.tolist() == [3.0, 3.0]
    shutil.rmtree(folder)


def killed_compiles(chance: random.Random, number: int) -> None:
    """A process that compiles dies at its n-th call of Python, for one n after the other: the next succeeds."""
    _code()
    folder = pathlib.Path(tempfile.mkdtemp(dir=_folder()))
    os.environ["SHELDRAKE_CACHE_DIR"] = str(folder)
    calls = _calls_of_a_compile()
    last = number % calls if number % 2 else calls - 1 - (number // 2) % 100  # half of them where files are written
    if (child := os.fork()) == 0:
        _compile_until(last)
    os.waitpid(child, 0)
    found = disk_cache.read(store._path(thrice))
    assert found is None or found == _code()[1]
    thrice.__dict__.pop("_native", None)
    assert thrice.native(x := np.ones(2)) == 0
    assert x.tolist() == [3.0, 3.0]
    assert disk_cache.read(store._path(thrice)) == _code()[1]
    shutil.rmtree(folder)


def _compile_until(last: int) -> None:
    count = 0

    def look(frame: Any, event: str, argument: Any) -> None:
        nonlocal count
        count += event in ("call", "c_call")
        if count > last:
            os.kill(os.getpid(), signal.SIGKILL)

    sys.setprofile(look)
    store.make(thrice, tell=False)
    os._exit(0)


@functools.cache
def _calls_of_a_compile() -> int:
    count = 0

    def look(frame: Any, event: str, argument: Any) -> None:
        nonlocal count
        count += event in ("call", "c_call")

    sys.setprofile(look)
    store.make(thrice, tell=False)
    sys.setprofile(None)
    return count
