"""The article's block in other units, where its file is present."""

import pathlib

import pytest

from sheldrake.cad import MakeUrdfFromMesh

ROOT = pathlib.Path(__file__).resolve().parents[3]
FOLDERS = [folder / "shared" / "models" / "slider" for folder in ROOT.parents[:2]]
SLIDER = next((f / "SliderBlockv3.obj" for f in FOLDERS if f.exists()), None)

pytestmark = pytest.mark.skipif(SLIDER is None, reason="the article's model is not here")


@pytest.mark.parametrize("unit, per_millimetre", [("mm", 1.0), ("in", 1.0 / 25.4), ("m", 1e-3)])
@pytest.mark.parametrize("mass", [None, 0.77])
def test_the_unit_is_found(tmp_path, unit, per_millimetre, mass):
    lines = []
    for line in SLIDER.read_text().splitlines():
        words = line.split()
        if words[:1] == ["v"]:
            line = "v {:.6f} {:.6f} {:.6f}".format(*(float(w) * per_millimetre for w in words[1:]))
        lines.append(line)
    path = tmp_path / "slider.obj"
    path.write_text("\n".join(lines))
    model = MakeUrdfFromMesh(path, mass=mass, output=tmp_path / "slider.urdf")
    assert model.units[0].unit == unit and 0.9 < model.units[0].confidence < 1.0
    assert model.volume == pytest.approx(4.1034171e-4, rel=1e-5)  # six decimals of a metre are rounded
    assert not model.warnings


def test_the_doctor_finds_the_articles_inertia(tmp_path):
    from sheldrake.cad import DiagnoseModel

    diagnosis = DiagnoseModel(SLIDER.parent / "slider-block.urdf")
    (error,) = diagnosis.errors()
    assert error.code == "inertia-too-large" and error.line == 4 and "0.77 kg" in error.message
    diagnosis.WriteFixed(tmp_path / "fixed.urdf")
    assert DiagnoseModel(tmp_path / "fixed.urdf").findings == []
