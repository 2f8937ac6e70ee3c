import importlib.util
import json
import os
import pathlib
import signal
import subprocess
import sys

import pytest

from sheldrake.cli import main
from sheldrake.common.kernel import jit_enabled

ROOT = pathlib.Path(__file__).parents[3]
ENVIRONMENT = {**os.environ, "PYTHONPATH": str(ROOT / "src")}


def sheldrake(*words, **options):
    return subprocess.run(
        [sys.executable, "-m", "sheldrake", *words], env=ENVIRONMENT, capture_output=True, text=True, **options
    )


def script(folder, text, name="script.py"):
    path = folder / name
    path.write_text(text)
    return str(path)


@pytest.mark.parametrize("command", ["c", "fmu"])
def test_what_needs_a_compiler_says_so_before_the_script_runs(command, monkeypatch, capsys, tmp_path):
    find = importlib.util.find_spec
    monkeypatch.setattr(importlib.util, "find_spec", lambda name: None if name == "ziglang" else find(name))
    path = script(tmp_path, "print('runs')")
    assert main([command, path, "-o", str(tmp_path / "out")]) == 1
    out, error = capsys.readouterr()
    assert out == ""
    assert error.startswith(f"sheldrake {command}: This command needs a compiler and a linker: pip install")


def test_a_script_for_pydrake_runs_as_it_is(tmp_path):
    (tmp_path / "beside.py").write_text("value = 7\n")
    path = script(
        tmp_path,
        """
import sys, pickle
from pydrake.autodiffutils import AutoDiffXd
from beside import value
class Mine: pass
assert type(pickle.loads(pickle.dumps(Mine()))) is Mine
if __name__ == "__main__":
    print(sys.argv[1:], value, AutoDiffXd.__module__, __file__ == sys.argv[0])
""",
    )
    result = sheldrake("run", path, "--duration", "5", "-x")
    assert result.returncode == 0, result.stderr
    assert result.stdout == "['--duration', '5', '-x'] 7 sheldrake.autodiffutils True\n"


def test_modules_packages_and_standard_input_run_too(tmp_path):
    package = tmp_path / "mine"
    package.mkdir()
    script(package, "", "__init__.py")
    script(package, "import sys; print('main', sys.argv[1:])", "__main__.py")
    script(package, "import pydrake; from . import other; print(__name__)", "tool.py")
    script(package, "", "other.py")
    assert sheldrake("run", "-m", "mine.tool", cwd=tmp_path).stdout == "__main__\n"
    assert sheldrake("run", "-m", "mine", "a", cwd=tmp_path).stdout == "main ['a']\n"
    assert sheldrake("run", "-", input="import pydrake; print(__name__)").stdout == "__main__\n"


@pytest.mark.parametrize("reader", ["file", "standard input"])
def test_annotations_of_a_script_are_what_they_say(tmp_path, reader):
    text = """
import dataclasses
from pydrake.common.yaml import yaml_load_typed

@dataclasses.dataclass
class Scenario:
    seed: int = 0
    names: dict[str, float] = dataclasses.field(default_factory=dict)

print(yaml_load_typed(schema=Scenario, data="seed: 3\\nnames: {a: 1.5}"), Scenario.__annotations__["seed"])
"""
    result = sheldrake("run", script(tmp_path, text)) if reader == "file" else sheldrake("run", "-", input=text)
    assert result.stdout == "Scenario(seed=3, names={'a': 1.5}) <class 'int'>\n", result.stderr


def test_tracebacks_begin_in_the_script(tmp_path):
    path = script(tmp_path, "def f():\n    raise ValueError('wrong')\n\nf()\n")
    result = sheldrake("run", path)
    assert result.returncode == 1
    lines = result.stderr.splitlines()
    assert lines[0] == "Traceback (most recent call last):" and lines[1] == f'  File "{path}", line 4, in <module>'
    assert lines[-1] == "ValueError: wrong" and "cli" not in result.stderr


def test_errors_of_the_script_itself(tmp_path):
    assert sheldrake("run", script(tmp_path, "raise SystemExit(3)")).returncode == 3
    result = sheldrake("run", script(tmp_path, "x = = 1\n"))
    assert result.returncode == 2 and "SyntaxError" in result.stderr and "_run.py" not in result.stderr
    result = sheldrake("run", "not_there.py")
    assert result.returncode == 2 and "there is no file 'not_there.py'" in result.stderr
    result = sheldrake("run", "-m", "not_there")
    assert result.returncode == 2 and "there is no module 'not_there'" in result.stderr
    result = sheldrake("run", script(tmp_path, "from pydrake.all import *\nDeformableModel()\n"))
    assert "Hint: pydrake.multibody.plant.DeformableModel is a name of pydrake that sheldrake will not" in result.stderr
    result = sheldrake("run", script(tmp_path, "from pydrake.all import *\nAcrobotPlant()\n"))
    assert "Hint: write `from pydrake.examples import AcrobotPlant`." in result.stderr


@pytest.mark.skipif(sys.platform == "win32", reason="signals differ")
def test_interrupting_says_where(tmp_path):
    path = script(tmp_path, "import time\n\nprint('ready', flush=True); time.sleep(300)\n")
    process = subprocess.Popen(
        [sys.executable, "-m", "sheldrake", "run", path],
        env=ENVIRONMENT,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )
    assert process.stdout.readline() == "ready\n"
    process.send_signal(signal.SIGINT)
    _, stderr = process.communicate(timeout=120)
    assert process.returncode == 130
    assert stderr.strip() == f"Interrupted at {path}:3."


def test_help_teaches(capsys):
    assert main([]) == 0
    text = capsys.readouterr().out
    for word in ("sheldrake demo", "sheldrake run script.py", "sheldrake info", "precompile"):
        assert word in text
    commands = text.partition("COMMAND\n")[2].partition("\n\n")[0].splitlines()
    assert all(len(line.split()) > 2 for line in commands), "a command and what it is for are on one line"
    with pytest.raises(SystemExit):
        main(["run", "--help"])
    assert "import pydrake" in capsys.readouterr().out


def test_info(capsys):
    assert main(["info", "--json"]) == 0
    facts = json.loads(capsys.readouterr().out)
    assert facts["packages"]["numpy"] and facts["threads"] >= 1 and facts["compiled kernels"] >= 0
    assert main(["info"]) == 0
    assert "cache folder" in capsys.readouterr().out


def test_precompile_compiles_what_it_lists(tmp_path, capsys, monkeypatch):
    """With two kernels in place of the package's: one compiles, one cannot."""
    from sheldrake.cli import _precompile

    class Fake:
        def __init__(self, name):
            self.__name__ = self.__qualname__ = name

        @property
        def address(self):
            if self.__name__ == "bad":
                raise TypeError("cannot")
            compiled.append(self.__name__)

        def __repr__(self):
            return f"<kernel {self.__name__}>"

    compiled = []
    monkeypatch.setattr(_precompile, "entry_kernels", lambda: iter([Fake("good"), Fake("bad")]))
    monkeypatch.setenv("SHELDRAKE_QUIET", "0")
    assert main(["precompile"]) == 1
    assert compiled == ["good"] and "<kernel bad>: TypeError: cannot" in capsys.readouterr().out


def test_precompile_of_a_real_kernel(monkeypatch):
    from sheldrake.cli import _precompile

    kernel = next(k for k in _precompile.entry_kernels() if k.__module__.endswith("primitives._kernels.blocks"))
    monkeypatch.setattr(_precompile, "entry_kernels", lambda: iter([kernel]))
    monkeypatch.setenv("SHELDRAKE_QUIET", "1")
    assert main(["precompile"]) == 0
    assert kernel.address > 0


def test_entry_kernels_are_found():
    from sheldrake.cli._precompile import entry_kernels
    from sheldrake.common.kernel import Kernel

    kernels = list(entry_kernels())
    assert kernels and len(set(map(id, kernels))) == len(kernels)
    assert all(isinstance(kernel, Kernel) and kernel.top for kernel in kernels)


@pytest.mark.skipif(not jit_enabled(), reason="without a compiler on purpose: SHELDRAKE_JIT=0 needs none")
def test_without_a_compiler_a_command_says_in_one_line_what_to_install(tmp_path):
    code = """
import sys
sys.modules["llvmlite"] = None
from sheldrake.cli import main
from sheldrake.common.kernel import jit_enabled
sys.exit(main(["demo", "--headless", "--seconds", "0.1"]))
"""
    environment = {**ENVIRONMENT, "SHELDRAKE_PREBUILT": "0", "SHELDRAKE_CACHE_DIR": str(tmp_path / "none")}
    done = subprocess.run([sys.executable, "-c", code], env=environment, capture_output=True, text=True, cwd=tmp_path)
    assert done.returncode == 1 and "Traceback" not in done.stderr
    assert "pip install 'sheldrake[kernels]'" in done.stderr.splitlines()[-1]


def test_a_reader_that_leaves_is_no_fault(tmp_path):
    """As in `sheldrake doctor robot.urdf | head -1`."""
    (tmp_path / "robot.urdf").write_text("<robot")
    reader, writer = os.pipe()
    os.close(reader)
    command = [sys.executable, "-m", "sheldrake", "doctor", "robot.urdf"]
    ended = subprocess.run(command, cwd=tmp_path, env=ENVIRONMENT, stdout=writer, stderr=subprocess.PIPE, text=True)
    os.close(writer)
    assert ended.stderr == ""
    assert ended.returncode == 141


@pytest.mark.parametrize(
    ("name", "data", "problem"),
    [
        ("none.npz", None, "there is no file 'none.npz'"),
        ("part.stl", b"\x80 solid", "'part.stl' is not a log: it is neither text nor an .npz or .parquet file"),
    ],
)
def test_plots_of_what_is_no_log(tmp_path, monkeypatch, capsys, name, data, problem):
    monkeypatch.chdir(tmp_path)
    if data is not None:
        pathlib.Path(name).write_bytes(data)
    assert main(["plot", name]) == 1
    assert problem in capsys.readouterr().err


@pytest.mark.parametrize(("word", "hint"), [("veiw", "did you mean 'view'?"), ("xyz", "there are run, demo")])
def test_a_misspelt_command_is_answered_with_the_nearest(word, hint, capsys):
    from sheldrake.cli import main

    assert main([word, "robot.urdf"]) == 2
    said = capsys.readouterr().err
    assert f"no command '{word}'" in said and hint in said and said.count("\n") == 1


def test_warnings_of_a_model_are_one_line(tmp_path, capsys, monkeypatch):
    from sheldrake.cli import main

    monkeypatch.chdir(tmp_path)
    text = '<robot name="r"><link name="a" odd="1"/><link name="b" odd="2"/><joint name="j" type="fixed" odd="3">'
    (tmp_path / "robot.urdf").write_text(text + '<parent link="a"/><child link="b"/></joint></robot>')
    assert main(["view", "robot.urdf", "--once"]) == 0
    said = [line for line in capsys.readouterr().err.splitlines() if "warning" in line]
    assert said == ["3 warnings about the model; all of them: sheldrake doctor robot.urdf"]


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["--verson"], "there is no option '--verson'; did you mean '--version'?"),
        (
            ["view", "--weldbase", "a.urdf"],
            "sheldrake view: error: there is no option '--weldbase'; did you mean '--weld",
        ),
        (["info", "extra"], "what is 'extra' for? One word too many."),
        (["run"], "give a script: sheldrake run script.py"),
    ],
)
def test_words_that_are_not_understood(words, said, capsys):
    with pytest.raises(SystemExit) as ended:
        main(words)
    assert ended.value.code == 2
    assert said in capsys.readouterr().err


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (
            ["report", "robot.urdf"],
            "a report is about a run: give a script or a file of logs; of a model, `sheldrake view",
        ),
        (["report", "nothing.npz"], "there is no file 'nothing.npz'"),
        (["demo", "nothing.stl", "--headless"], "nothing.stl: error: The file does not exist"),
        (["demo", "part.stl", "--headless"], "'part.stl' has 8 bytes, too few for a binary STL file"),
        (["doctor", "part.stl"], "of a part from CAD `sheldrake mesh2urdf` makes a model"),
    ],
)
def test_files_that_are_not_what_a_command_is_for(words, said, capsys, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "part.stl").write_text("solid a\n")
    assert main(words) in (1, 2)
    assert said in capsys.readouterr().err


def test_a_model_is_no_script(tmp_path, capsys):
    (tmp_path / "part.urdf").write_text("<robot/>")
    for command in ("run", "page", "c", "fmu"):
        result = sheldrake(command, str(tmp_path / "part.urdf"))
        assert result.returncode == 2
        assert (
            f"sheldrake {command}: " in result.stderr and "is a model, not a script: `sheldrake view" in result.stderr
        )


def test_ctrl_c_ends_a_tool_in_one_line(monkeypatch, capsys):
    import sheldrake.cli._doctor

    def interrupted(options):
        raise KeyboardInterrupt

    monkeypatch.setattr(sheldrake.cli._doctor, "run", interrupted)
    assert main(["doctor", "part.urdf"]) == 130
    assert capsys.readouterr().err == "\nInterrupted.\n"


def test_a_demo_without_time_or_place(tmp_path, capsys):
    assert main(["demo", "--headless", "--seconds", "-1"]) == 2
    assert "--seconds must be positive and finite, not -1." in capsys.readouterr().err
    (tmp_path / "taken").write_text("")
    assert main(["demo", "--headless", "--seconds", "0.01", "--out", str(tmp_path / "taken")]) == 1
    assert "nothing can be written to" in capsys.readouterr().err
