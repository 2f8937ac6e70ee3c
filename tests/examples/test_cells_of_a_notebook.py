"""What cells of a notebook show: each plot once, and how far a simulation is."""

from __future__ import annotations

import pytest
from pages import ROOT

LOG = """
from sheldrake.systems.primitives import VectorLog
from sheldrake.visualization import PlotLog
log = VectorLog(1); log.AddData(0.0, [1.0]); log.AddData(1.0, [2.0])
"""
SIMULATION = """
from sheldrake.systems.analysis import Simulator, _progress
from sheldrake.systems.primitives import LinearSystem
_progress.Progress.PATIENCE = _progress.Progress.EVERY = 0.0
simulator = Simulator(LinearSystem(A=[[1.0]], time_period=1e-3))
simulator.set_target_realtime_rate(20.0)
"""


@pytest.fixture
def run(tmp_path, monkeypatch):
    """Runs cells; gives the outputs of each, and all messages of the kernel that show something."""
    nbformat, nbclient = pytest.importorskip("nbformat"), pytest.importorskip("nbclient")
    pytest.importorskip("ipykernel")
    monkeypatch.setenv("PYTHONPATH", str(ROOT / "src"))
    for variable in ("MPLBACKEND", "SHELDRAKE_PROGRESS"):
        monkeypatch.delenv(variable, raising=False)

    class Client(nbclient.NotebookClient):
        shown: list = []

        def process_message(self, message, cell, index):
            if "data" in message["content"]:
                self.shown.append((message["header"]["msg_type"], message["content"]["data"]))
            return super().process_message(message, cell, index)

    def cells(*sources):
        notebook = nbformat.v4.new_notebook(cells=[nbformat.v4.new_code_cell(source) for source in sources])
        client = Client(notebook, timeout=300, resources={"metadata": {"path": tmp_path}})
        client.execute()
        return [cell.outputs for cell in notebook.cells], client.shown

    return cells


def pictures(outputs):
    return sum("image/png" in output.get("data", {}) for output in outputs)


def test_a_plot_is_shown_once(run):
    last = "PlotLog(log)"
    named = "figure = PlotLog(log)"
    two = "PlotLog(log)\nPlotLog(log)"
    plain = "import matplotlib.pyplot as plt\nplt.figure().add_subplot()"
    found, _ = run(LOG, last, named, "figure", "figure.axes[0].set_title('again')\nfigure", two, plain, "PlotLog(log);")
    assert [pictures(outputs) for outputs in found] == [0, 1, 1, 1, 1, 2, 1, 1]


def test_progress_stands_below_the_cell_and_is_wiped(run):
    found, shown = run(SIMULATION, "simulator.AdvanceTo(2.0);\nprint('there')")
    texts = [data["text/plain"] for _, data in shown]
    assert texts[0].startswith("simulating: ") and " of 2 s, " in texts[0]
    assert texts[-1] == "" and len(shown) > 1
    assert [kind for kind, _ in shown] == ["display_data"] + ["update_display_data"] * (len(shown) - 1)
    progress, printed = found[1]
    assert progress["data"] == {"text/plain": ""}
    assert printed["text"] == "there\n"
