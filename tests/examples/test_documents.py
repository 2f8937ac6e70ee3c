"""What the documents show runs, and gives what they say it gives."""

from __future__ import annotations

import os
import pathlib
import re
import subprocess
import sys

import pytest
from pages import run_page

ROOT = pathlib.Path(__file__).resolve().parents[2]
GUIDE = ROOT / "src" / "sheldrake" / "GUIDE.md"
OLD_SCRIPT = pathlib.Path(__file__).with_name("script_of_2021.py")
BLOCK = ROOT / "src" / "sheldrake" / "models" / "two_hole_block" / "two_hole_block.urdf"


def run(*command, cwd, **more):
    environment = {**os.environ, "PYTHONPATH": str(ROOT / "src"), "MPLBACKEND": "Agg", **more}
    options = {"cwd": cwd, "env": environment, "capture_output": True, "text": True, "timeout": 120}
    done = subprocess.run([sys.executable, *command], check=False, **options)
    assert done.returncode == 0, done.stderr
    return done


def test_readme_code_prints_what_its_comment_says(tmp_path):
    text = (ROOT / "README.md").read_text(encoding="utf-8")
    (code,) = re.findall(r"```python\n(.*?)```", text, re.DOTALL)
    expected = re.search(r"print\(.*\)  # (.*)", code).group(1)
    assert run("-c", code, cwd=tmp_path).stdout.strip() == expected


def test_guide_gives_what_it_says(tmp_path, monkeypatch, capsys):
    from sheldrake.cli import main

    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("MPLBACKEND", "Agg")
    assert run_page(GUIDE) >= 8
    assert main(["guide"]) == 0
    assert capsys.readouterr().out.strip() == GUIDE.read_text(encoding="utf-8").strip()
    assert main(["guide", "--path"]) == 0
    assert pathlib.Path(capsys.readouterr().out.strip()) == GUIDE


def quoted_errors():
    """The texts of errors in the guide's table: those in quotation marks, cut at the dots."""
    rows = re.findall(r"^\| (\".*?) \| .* \|$", GUIDE.read_text(encoding="utf-8"), re.MULTILINE)
    quoted = [text for row in rows for text in re.findall(r'"(.*?)"', row)]
    return [part.strip() for text in quoted for part in text.split("...") if part.strip()]


def test_errors_that_the_guide_quotes_are_raised():
    from sheldrake import all as s

    raised = []

    def collect(call, *args):
        with pytest.raises(RuntimeError) as caught:
            call(*args)
        raised.append(str(caught.value))

    plant = s.MultibodyPlant(1e-3)
    collect(plant.CreateDefaultContext)
    plant.Finalize()
    collect(plant.AddRigidBody, "late", s.SpatialInertia.SolidSphereWithMass(1.0, 1.0))
    collect(plant.GetBodyByName, "nobody")
    builder = s.DiagramBuilder()
    gain = builder.AddSystem(s.Gain(1.0, 2))
    root = builder.Build().CreateDefaultContext()
    collect(gain.get_output_port().Eval, gain.GetMyContextFromRoot(root))
    collect(gain.get_output_port().Eval, root)
    builder = s.DiagramBuilder()
    gain = builder.AddSystem(s.Gain(1.0, 2))
    builder.Connect(gain.get_output_port(), gain.get_input_port())
    collect(builder.Build)
    quoted = quoted_errors()
    assert len(quoted) == 8
    for text in quoted:
        assert any(text in error for error in raised), text


def test_example_runs_as_a_program(tmp_path):
    """As people start it; the other examples run in tests/examples/test_gallery.py, in one process."""
    out = run(str(ROOT / "examples" / "drop_the_block.py"), "--headless", cwd=tmp_path).stdout
    assert "15001 samples" in out
    assert (tmp_path / "block.png").stat().st_size > 10_000


def test_a_script_of_2021_runs_unchanged(tmp_path):
    done = run("-m", "sheldrake", "run", str(OLD_SCRIPT), str(BLOCK), cwd=tmp_path)
    assert "(13, " in done.stdout
    assert "at rest" not in done.stdout, "under the alias contact has Drake's single point: the block keeps moving"
    for today in ("AddModels", "MeshcatVisualizer.AddToBuilder", "ForcedPublish"):
        assert today in done.stderr, f"no hint names {today}"
    assert "No meshcat-server answers" in done.stdout + done.stderr


def test_demo_leaves_its_files(tmp_path):
    out = run("-m", "sheldrake", "demo", "--headless", cwd=tmp_path).stdout
    assert "the block is at rest" in out
    folder = tmp_path / "sheldrake-demo"
    assert {p.name for p in folder.iterdir()} == {"block.npz", "block.csv", "block.png", "block.html"}
    html = (folder / "block.html").read_text(encoding="utf-8")
    assert len(html) < 3_000_000
    assert (folder / "block.csv").read_text().startswith("time,body_qw,body_qx")


@pytest.mark.parametrize("name", ["README.md", "CONTRIBUTING.md", "ARCHITECTURE.md"])
def test_files_that_documents_name_exist(name):
    text = (ROOT / name).read_text(encoding="utf-8")
    for path in re.findall(r"`((?:examples|tests|tools|benchmarks|src|changelog)/[\w./-]+)`", text):
        assert (ROOT / path).exists(), f"{name} names {path}"
