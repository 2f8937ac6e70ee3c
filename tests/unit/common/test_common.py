import copy
import logging
import os
import pickle
import sys

import numpy as np
import pytest
from tests.unit.common.counting import calls_of

import sheldrake.common as common
from sheldrake.common import MemoryFile, Parallelism, RandomDistribution, RandomGenerator, Sha256
from sheldrake.common.containers import EqualToDict, namedview
from sheldrake.common.deprecation import ModuleShim, _forward_callables_as_deprecated, install_numpy_warning_filters
from sheldrake.common.jupyter import process_ipywidget_events


def test_memory_file():
    file = MemoryFile(contents="abc", extension=".TXT", filename_hint="hint")
    assert (file.contents(), file.extension(), file.filename_hint()) == (b"abc", ".txt", "hint")
    assert file.sha256() == Sha256.Checksum("abc") == Sha256.Checksum(b"abc")
    assert repr(file) == "MemoryFile(contents=b'abc', extension='.txt', filename_hint='hint')"
    assert repr(MemoryFile(b"x" * 200, ".a", "")).count("x") < 120
    assert repr(copy.deepcopy(file)) == repr(copy.copy(file)) == repr(file)
    assert MemoryFile().contents() == b"" and MemoryFile().extension() == ""
    with pytest.raises(RuntimeError, match="invalid extension"):
        MemoryFile("abc", "txt", "")
    with pytest.raises(RuntimeError, match="one line"):
        MemoryFile("abc", ".txt", "a\nb")
    with pytest.raises(TypeError):
        MemoryFile(3)


def test_memory_file_of_a_path(tmp_path):
    (tmp_path / "a.OBJ").write_bytes(b"\xff")
    file = MemoryFile.Make(tmp_path / "a.OBJ")
    assert (file.contents(), file.extension()) == (b"\xff", ".obj")
    assert file.filename_hint() == str(tmp_path / "a.OBJ")
    with pytest.raises(RuntimeError, match="cannot read the file"):
        MemoryFile.Make(tmp_path / "missing")


def test_checksum():
    a, b = Sha256.Checksum("abc"), Sha256.Checksum("abd")
    assert a.to_string().startswith("ba7816bf") and Sha256.Parse(a.to_string()) == a
    assert Sha256.Parse("x") is None and Sha256().to_string() == "0" * 64
    assert a != b and (a < b) != (b < a)


def test_parallelism(monkeypatch):
    assert Parallelism().num_threads() == Parallelism(False).num_threads() == 1
    assert Parallelism(True).num_threads() == Parallelism.Max().num_threads() >= 1
    assert repr(copy.copy(Parallelism(num_threads=4))) == "Parallelism(num_threads=4)"
    monkeypatch.setenv("DRAKE_NUM_THREADS", "1")
    assert Parallelism(parallelize=True).num_threads() == 1
    with pytest.raises(RuntimeError, match="at least 1"):
        Parallelism(0)
    with pytest.raises(TypeError):
        Parallelism(1.5)


def test_resources(tmp_path, monkeypatch):
    (tmp_path / "drake").mkdir()
    (tmp_path / "drake" / "a.txt").write_text("a")
    monkeypatch.setenv("DRAKE_RESOURCE_ROOT", str(tmp_path))
    assert common.FindResourceOrThrow("drake/a.txt") == str(tmp_path / "drake" / "a.txt")
    assert common.GetDrakePath() == str(tmp_path / "drake")
    for path, message in (
        ("drake/b.txt", "Could not find"),
        ("b.txt", "does not start with drake/"),
        ("/b.txt", "is not a relative path"),
    ):
        with pytest.raises(RuntimeError, match=message):
            common.FindResourceOrThrow(path)
    assert os.path.isdir(common.temp_directory()) and common.temp_directory() != common.temp_directory()


def test_resources_of_an_installed_wheel(tmp_path, monkeypatch):
    monkeypatch.delenv("DRAKE_RESOURCE_ROOT", raising=False)
    monkeypatch.setattr("sys.path", [str(tmp_path)])
    with pytest.raises(RuntimeError, match=r"Looked in no folder\. Set DRAKE_RESOURCE_ROOT"):
        common.FindResourceOrThrow("drake/a.txt")
    share = tmp_path / "pydrake" / "share" / "drake"
    share.mkdir(parents=True)
    (share / "a.txt").write_text("a")
    assert common.GetDrakePath() is None  # a folder of that name, and no wheel
    (tmp_path / "drake-1.51.1.dist-info").mkdir()
    assert common.FindResourceOrThrow("drake/a.txt") == str(share / "a.txt")
    assert common.GetDrakePath() == str(share)


def test_logging():
    logger = logging.getLogger("drake")
    old = logger.level
    try:
        common.set_log_level("debug")
        assert logger.level == logging.DEBUG
        assert common.set_log_level("warn") == "debug"
        assert common.set_log_level("unchanged") == "warn"
        with pytest.raises(RuntimeError, match="unknown level"):
            common.set_log_level("loud")
    finally:
        logger.setLevel(old)
    common.use_native_cpp_logging()


def test_random_generator():
    a, b = RandomGenerator(3), RandomGenerator(seed=3)
    assert [a() for _ in range(4)] == [b() for _ in range(4)]
    with pytest.raises(TypeError):
        RandomGenerator(-1)
    assert common.CalcProbabilityDensity(RandomDistribution.kUniform, [0.5, 1.5]) == 0.0
    with pytest.raises(TypeError):
        common.CalcProbabilityDensity(RandomDistribution.kUniform, "a")


@pytest.mark.parametrize("drawn", [0, 1, 623, 624, 1300])
def test_copies_of_a_random_generator_go_on_with_its_numbers(drawn):
    generator, numpys = RandomGenerator(7), np.random.RandomState(7)
    assert [generator() for _ in range(drawn)] == numpys.randint(0, 2**32, drawn, np.uint64).tolist()
    copies = [copy.copy(generator), copy.deepcopy(generator), pickle.loads(pickle.dumps(generator))]
    follow = numpys.randint(0, 2**32, 1300, np.uint64).tolist()
    for one in (*copies, generator):
        assert [one() for _ in range(1300)] == follow


def test_a_copy_of_a_random_generator_costs_nothing():
    generator = RandomGenerator(7)
    generator()
    assert calls_of(lambda: copy.deepcopy(generator)) <= 20


def test_assertion_failure():
    assert common.kDrakeAssertIsArmed is False
    with pytest.raises(SystemExit, match="condition 'false' failed"):
        common.trigger_an_assertion_failure()


class Key:
    def __init__(self, n):
        self.n = n

    def __hash__(self):
        return hash(self.n)

    def __eq__(self, other):
        raise AssertionError("compared by ==")

    def EqualTo(self, other):
        return self.n == other.n


def test_equal_to_dict():
    key = Key(1)
    d = EqualToDict({key: "a"})
    d[Key(2)] = "b"
    assert d[Key(1)] == "a" and Key(2) in d and Key(3) not in d and d.get(Key(3), "c") == "c"
    assert next(iter(d.keys())) is key
    assert dict(d.items()) == d.raw()
    del d[Key(1)]
    assert Key(1) not in d


def test_namedview():
    View = namedview("View", ["a", "b c", "2x"])
    assert View.get_fields() == ("a", "b_c", "_2x")
    values = np.array([1.0, 2.0, 3.0])
    view = View(values)
    view.a = 10.0
    view[1] = 20.0
    values[2] = 30.0
    assert list(view) == [10.0, 20.0, 30.0] and len(view) == 3 and view._2x == 30.0
    assert np.shares_memory(np.asarray(view), values) and not np.shares_memory(np.array(view), values)
    assert str(View([1, 2, 3])) == "View(a=1, b_c=2, _2x=3)" and repr(View.Zero()) == "<View(a=0, b_c=0, _2x=0)>"
    with pytest.raises(AttributeError, match="no field 'd'"):
        view.d = 1
    with pytest.raises(AssertionError):
        namedview("V", ["a b", "a  b"])
    with pytest.raises(AssertionError):
        View([1, 2])


def test_without_a_notebook_no_events_are_looked_for():
    before = set(sys.modules)
    process_ipywidget_events(3)
    assert not any(name.startswith(("ipykernel", "asyncio")) for name in set(sys.modules) - before)


def test_module_shim_and_forwarding():
    import types

    module = types.ModuleType("old")
    module.__all__ = ["known"]
    module.known = 1
    asked = []

    def handler(name):
        asked.append(name)
        if name == "late":
            return 2
        raise AttributeError()

    shim = ModuleShim(module, handler)
    assert shim.known == 1 and shim.late == 2 and shim.late == 2 and asked == ["late"]
    with pytest.raises(AttributeError, match="no attribute 'nothing'"):
        getattr(shim, "nothing")  # noqa: B009
    new = types.ModuleType("new")
    new.function = lambda x: x + 1
    old = {"__name__": "old"}
    _forward_callables_as_deprecated(old, new, date="2038-01-19")
    with pytest.warns(DeprecationWarning, match=r"new\.function"):
        assert old["function"](1) == 2
    install_numpy_warning_filters()


def test_public_objects_pickle():
    assert pickle.loads(pickle.dumps(RandomDistribution.kGaussian)) is RandomDistribution.kGaussian
    assert pickle.loads(pickle.dumps(Sha256.Checksum("a"))) == Sha256.Checksum("a")


def test_all_has_the_names_of_every_module():
    from sheldrake.common import all as everything

    for name in ("RandomGenerator", "Quaternion", "Value", "namedview", "yaml_load", "Rotation"):
        assert name in everything.__all__ and hasattr(everything, name)
    assert len(set(everything.__all__)) == len(everything.__all__)


def test_start_up_is_light():
    import subprocess
    import sys

    heavy = "llvmlite scipy matplotlib viser trimesh rich yaml".split()
    modules = ["common", "common.schema", "common.value", "math", "multibody.math", "common.containers"]
    imports = "; ".join(f"import sheldrake.{module}" for module in modules)
    script = f"import sys; {imports}; print([m for m in {heavy} if m in sys.modules])"
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join(sys.path)}
    done = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, env=environment)
    assert done.stdout.strip() == "[]", done.stdout + done.stderr


def test_modules_are_found_without_importing_them():
    assert common.schema.Gaussian(1, 2).Mean() == 1.0 and common.yaml.yaml_load(data="3") == 3
    with pytest.raises(AttributeError, match="no attribute 'nothing'"):
        common.nothing  # noqa: B018
