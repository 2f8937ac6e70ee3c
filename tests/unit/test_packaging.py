"""The build hook of the wheel."""

import importlib.util
import json
import os
import pathlib
import subprocess
import types

import pytest

ROOT = pathlib.Path(__file__).parents[2]


def test_the_hook_compiles_with_what_the_build_environment_offers(monkeypatch, tmp_path):
    """pip's isolated builds put llvmlite and ziglang on PYTHONPATH: the compiling process must see them too."""
    pytest.importorskip("hatchling", reason="the hook is a class of hatchling's")
    spec = importlib.util.spec_from_file_location("hatch_build", ROOT / "hatch_build.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    calls = []

    def run(command, check, env):
        calls.append((command, env["PYTHONPATH"].split(os.pathsep)))
        raise subprocess.CalledProcessError(1, command)

    warnings = []
    monkeypatch.setattr(module.subprocess, "run", run)
    monkeypatch.setenv("PYTHONPATH", f"a{os.pathsep}b")
    monkeypatch.setenv("SHELDRAKE_PREBUILT_DIR", str(tmp_path))
    monkeypatch.delenv("SHELDRAKE_WHEEL_PLATFORM", raising=False)
    monkeypatch.delenv("SHELDRAKE_NO_PREBUILT", raising=False)
    app = types.SimpleNamespace(display_info=lambda text: None, display_warning=warnings.append)
    hook = module.PrebuiltKernels(str(ROOT), {}, None, None, str(tmp_path), "wheel", app)
    data = {"force_include": {}}
    hook.initialize("standard", data)
    ((command, path),) = calls
    assert command[1:3] == ["-m", "sheldrake.common._native.build"]
    assert path == [str(ROOT / "src"), "a", "b"]
    assert "a plain wheel" in warnings[0] and data == {"force_include": {}}
    hook.initialize("editable", data)
    assert len(calls) == 1


def test_kernels_that_are_built_already_are_taken(tmp_path):
    """As tools/build_wheels.py does: it builds the kernels of all platforms first."""
    pytest.importorskip("hatchling", reason="the hook is a class of hatchling's")
    from sheldrake.common._native.source import source_hashes

    spec = importlib.util.spec_from_file_location("hatch_build", ROOT / "hatch_build.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    manifest = tmp_path / "kernels.json"
    assert not module.PrebuiltKernels._is_current(tmp_path)
    manifest.write_text(json.dumps({"sources": source_hashes()}))
    assert module.PrebuiltKernels._is_current(tmp_path)
    manifest.write_text(json.dumps({"sources": {**source_hashes(), "one/more.py": ["0", "1"]}}))
    assert not module.PrebuiltKernels._is_current(tmp_path)
