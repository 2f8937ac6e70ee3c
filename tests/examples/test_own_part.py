"""The way of a new user: a part from CAD, looked at, dropped, plotted."""

import os
import pathlib

import numpy as np
from tests.unit.cad import solids

from sheldrake.cli import main


def test_from_stl_to_plot(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    outer, inner = 1000.0 * solids.polygon(24, 0.03), 1000.0 * solids.polygon(24, 0.012)
    pathlib.Path("part.stl").write_bytes(solids.binary_stl(*solids.extruded(outer, 20.0, [inner])))
    assert main(["mesh2urdf", "part.stl", "--mass", "0.07", "-o", "part.urdf"]) == 0
    assert "millimetres" in capsys.readouterr().out
    assert main(["doctor", "part.urdf"]) == 0
    assert main(["demo", "part.urdf", "--headless", "--seconds", "2"]) == 0
    assert "the part is at rest" in capsys.readouterr().out
    with np.load("sheldrake-demo/part.npz") as log:
        z = log["data"][list(log["names"]).index(next(n for n in log["names"] if n.endswith("_z")))]
    assert 0.2 < z[0] < 0.4 and abs(z[-1]) < 1e-3  # from three times its size; its origin is on its lower face
    assert main(["plot", "sheldrake-demo/part.npz", "--rpy", "-o", "block.png"]) == 0
    assert pathlib.Path("block.png").stat().st_size > 10_000
    assert main(["report", "sheldrake-demo/part.npz"]) == 0
    assert pathlib.Path("part.html").stat().st_size < 1e6


def test_a_mesh_is_dropped_as_it_comes(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    pathlib.Path("mm.stl").write_bytes(solids.binary_stl(*solids.box(60.0, 40.0, 25.0)))
    pathlib.Path("m.stl").write_bytes(solids.binary_stl(*solids.box(0.06, 0.04, 0.025)))
    assert main(["view", "mm.stl", "--once"]) == 0
    assert len(os.listdir()) == 2, "looking leaves nothing"
    for name, seconds in (("mm", "1.5"), ("m", "8")):
        assert main(["demo", f"{name}.stl", "--headless", "--seconds", seconds]) == 0
        said = capsys.readouterr()
        assert "so the part is 60 x 40 x 25 mm" in said.out and f"the {name} is at rest" in said.out
        assert "Making it ready to fall" in said.err
    short, long = (pathlib.Path(f"sheldrake-demo/{name}.html").stat().st_size for name in ("mm", "m"))
    assert long < 1.1 * short, "what rests is not recorded on"


def test_a_mesh_that_is_no_solid_or_whose_unit_is_unclear_is_not_dropped(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    sheet = np.array([[0, 0, 0], [50, 0, 0], [0, 50, 0]]), np.array([[0, 1, 2]])
    pathlib.Path("sheet.stl").write_bytes(solids.binary_stl(*sheet))
    pathlib.Path("box.stl").write_bytes(solids.binary_stl(*solids.box(5.0, 5.0, 5.0)))
    assert main(["demo", "sheet.stl", "--headless"]) == 1
    assert "it is a surface, not a solid" in capsys.readouterr().err
    assert main(["demo", "box.stl", "--headless"]) == 1
    assert "`sheldrake mesh2urdf box.stl --units mm` makes a model of it" in capsys.readouterr().err


def test_a_part_in_millimetres_says_so_before_and_after(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    pathlib.Path("part.obj").write_bytes(solids.obj(*solids.box(60.0, 40.0, 25.0)))
    inertia = "<mass value='.5'/><inertia ixx='1e-4' iyy='2e-4' izz='2e-4' ixy='0' ixz='0' iyz='0'/>"
    collision = "<collision><geometry><mesh filename='part.obj'/></geometry></collision>"
    pathlib.Path("part.urdf").write_text(
        f"<robot name='part'><link name='body'><inertial>{inertia}</inertial>{collision}</link></robot>"
    )
    assert main(["demo", "part.urdf", "--headless", "--seconds", "0.2"]) == 0
    said = capsys.readouterr()
    assert "it looks like millimetres" in said.err and "sheldrake doctor part.urdf --fix FILE" in said.err
    assert "'body' is 60 x 40 x 25 m and has 0.5 kg: 1000 times too large" in said.out
