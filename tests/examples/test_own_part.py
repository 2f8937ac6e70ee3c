"""The way of a new user: a part from CAD, looked at, dropped, plotted."""

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
    assert "the block is at rest" in capsys.readouterr().out
    with np.load("sheldrake-demo/block.npz") as log:
        z = log["data"][list(log["names"]).index(next(n for n in log["names"] if n.endswith("_z")))]
    assert z[0] == 0.1 and abs(z[-1]) < 1e-3  # its origin is on its lower face
    assert main(["plot", "sheldrake-demo/block.npz", "--rpy", "-o", "block.png"]) == 0
    assert pathlib.Path("block.png").stat().st_size > 10_000
    assert main(["report", "sheldrake-demo/block.npz"]) == 0
    assert pathlib.Path("block.html").stat().st_size < 1e6
