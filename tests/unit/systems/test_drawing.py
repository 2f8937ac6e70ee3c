import pathlib
import stat
import sys

import numpy as np
import pytest

from sheldrake.systems import drawing
from sheldrake.systems.framework import DiagramBuilder
from sheldrake.systems.primitives import Adder


def diagram():
    builder = DiagramBuilder()
    adder = builder.AddNamedSystem("total", Adder(2, 1))
    builder.ExportInput(adder.get_input_port(0), "u")
    builder.ExportOutput(adder.get_output_port(0), "y")
    return builder.Build()


def test_without_graphviz_the_error_says_what_to_install(monkeypatch):
    monkeypatch.setattr(drawing.shutil, "which", lambda name: None)
    monkeypatch.setitem(sys.modules, "pygraphviz", None)
    with pytest.raises(ImportError, match="pygraphviz"):
        drawing.plot_system_graphviz(diagram())


@pytest.mark.skipif(sys.platform == "win32", reason="the stand-in for dot is a script with a shebang")
def test_a_system_is_drawn_by_dot(tmp_path, monkeypatch):
    """A stand-in for dot checks its input and answers with a picture of known size."""
    import matplotlib

    matplotlib.use("Agg")
    import matplotlib.image

    picture = tmp_path / "picture.png"
    matplotlib.image.imsave(picture, np.zeros((3, 5, 3)))
    dot = tmp_path / "dot"
    dot.write_text(
        f"#!{sys.executable}\nimport sys\ntext = sys.stdin.read()\nassert 'total' in text and sys.argv[1] == '-Tpng'\n"
        f"sys.stdout.buffer.write(open({str(picture)!r}, 'rb').read())\n"
    )
    dot.chmod(dot.stat().st_mode | stat.S_IEXEC)
    monkeypatch.setattr(drawing.shutil, "which", lambda name: str(pathlib.Path(dot)))
    image = drawing.plot_system_graphviz(diagram(), max_depth=1)
    assert image.get_array().shape[:2] == (3, 5)
