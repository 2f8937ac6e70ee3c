import io
import sys

import pytest
from tests.unit.cad.solids import write_box

from sheldrake.cli import main


def test_a_part_becomes_a_description(tmp_path, capsys):
    part = write_box(tmp_path / "part.obj", 60.0, 40.0, 25.0)
    assert main(["mesh2urdf", part, "--mass", "0.77", "-o", str(tmp_path / "part.urdf")]) == 0
    said = capsys.readouterr().out
    assert "millimetres" in said and "sure" in said and "watertight" in said and "wrote" in said
    text = (tmp_path / "part.urdf").read_text()
    assert 'filename="part.obj" scale="0.001 0.001 0.001"' in text and '<mass value="0.77"/>' in text


def test_a_page_to_look_at(tmp_path, capsys):
    import threading

    threads = set(threading.enumerate())
    part = write_box(tmp_path / "part.obj", 60.0, 40.0, 25.0)
    words = ["--mass", "0.77", "-o", str(tmp_path / "part.urdf"), "--preview", str(tmp_path / "part.html")]
    assert main(["mesh2urdf", part, *words]) == 0
    page = (tmp_path / "part.html").read_text()
    assert "<title>part: 60 x 40 x 25 mm, 0.77 kg</title>" in page and len(page) < 3e6
    assert "part.html" in capsys.readouterr().out
    assert not set(threading.enumerate()) - threads


def test_unsure_asks_and_writes_nothing(tmp_path, capsys):
    part = write_box(tmp_path / "part.obj", 6.0, 4.0, 2.5)
    assert main(["mesh2urdf", part]) == 2
    said = capsys.readouterr().err
    assert "Which unit" in said and "--units cm" in said
    assert not (tmp_path / "part.urdf").exists()
    assert main(["mesh2urdf", part, "--units", "cm"]) == 0
    assert (tmp_path / "part.urdf").exists()


@pytest.mark.parametrize("answer, status", [("cm", 0), ("feet", 2), ("", 2)])
def test_at_a_terminal_the_answer_counts(tmp_path, capsys, monkeypatch, answer, status):
    class Terminal(io.StringIO):
        def isatty(self):
            return True

    part = write_box(tmp_path / "part.obj", 6.0, 4.0, 2.5)
    monkeypatch.setattr(sys, "stdin", Terminal(answer + "\n"))
    monkeypatch.setattr(sys.stderr, "isatty", lambda: True, raising=False)
    assert main(["mesh2urdf", part]) == status
    assert (tmp_path / "part.urdf").exists() == (status == 0)
    if status == 0:
        assert 'scale="0.01 0.01 0.01"' in (tmp_path / "part.urdf").read_text()


def test_errors_are_one_line(tmp_path, capsys):
    assert main(["mesh2urdf", str(tmp_path / "absent.stl"), "-o", str(tmp_path / "x.urdf")]) == 1
    assert capsys.readouterr().err.count("\n") == 1
    with pytest.raises(SystemExit):
        main(["mesh2urdf", "a.stl", "--mass", "1", "--density", "2"])


def test_what_cannot_be_written_or_read_says_what_to_do(tmp_path, capsys):
    part = tmp_path / "part.obj"
    write_box(part, 60.0, 40.0, 25.0)
    before = part.read_bytes()
    assert main(["mesh2urdf", str(part), "-o", str(part)]) == 1
    assert "does not end with .urdf" in capsys.readouterr().err
    assert part.read_bytes() == before
    assert main(["mesh2urdf", str(part), "-o", str(tmp_path / "no" / "part.urdf")]) == 1
    assert f"there is no folder '{tmp_path / 'no'}'" in capsys.readouterr().err
    (tmp_path / "part.step").write_text("ISO-10303-21;")
    assert main(["mesh2urdf", str(tmp_path / "part.step")]) == 1
    assert "Export the part as STL" in capsys.readouterr().err
    assert main(["convert", str(tmp_path / "part.step"), str(tmp_path / "part.urdf")]) == 1
    assert "Export the part as STL" in capsys.readouterr().err


def test_a_conversion_does_not_overwrite_its_source(tmp_path, capsys):
    model = tmp_path / "model.urdf"
    model.write_text('<robot name="a"><!-- mine --><link name="b"/></robot>')
    assert main(["convert", str(model), str(model)]) == 1
    assert "is the source itself" in capsys.readouterr().err and "mine" in model.read_text()
    assert main(["convert", str(model), str(tmp_path / "no" / "model.sdf")]) == 1
    assert "there is no folder" in capsys.readouterr().err
