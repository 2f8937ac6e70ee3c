"""The notebook that is made of the tutorial has its code, in its order, and runs from top to bottom."""

from __future__ import annotations

import pytest
from pages import ROOT, blocks
from tools import make_notebook

PAGE = (ROOT / "docs" / "tutorial.md").read_text(encoding="utf-8")


def test_cells_are_the_blocks_of_the_page():
    cells = make_notebook.cells(PAGE)
    code = ["".join(cell["source"]) for cell in cells if cell["cell_type"] == "code"]
    assert code == [text.rstrip("\n") for _, text in blocks(PAGE)]
    text = "".join(line for cell in cells if cell["cell_type"] == "markdown" for line in cell["source"])
    assert "```python" not in text
    assert text.startswith("# ")
    assert "](" not in text, "a notebook travels alone"


def test_it_runs_in_jupyter(tmp_path, monkeypatch):
    nbformat, nbclient = pytest.importorskip("nbformat"), pytest.importorskip("nbclient")
    pytest.importorskip("ipykernel")
    monkeypatch.setenv("PYTHONPATH", str(ROOT / "src"))
    make_notebook.main(str(ROOT / "docs" / "tutorial.md"), str(tmp_path / "tutorial.ipynb"))
    notebook = nbformat.read(tmp_path / "tutorial.ipynb", as_version=4)
    nbformat.validate(notebook)
    nbclient.NotebookClient(notebook, timeout=300, resources={"metadata": {"path": tmp_path}}).execute()
    printed = [output["text"] for cell in notebook.cells for output in cell.get("outputs", []) if "text" in output]
    assert any("7 6" in text for text in printed)
    assert (tmp_path / "part.html").exists()
