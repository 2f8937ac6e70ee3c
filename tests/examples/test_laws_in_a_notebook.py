"""The laws of `docs/own_laws.md` in a notebook: how fast they compile, and that mistakes show the line of the cell."""

from __future__ import annotations

import pytest
from pages import ROOT, blocks

from sheldrake.common.kernel import jit_enabled

pytestmark = pytest.mark.skipif(not jit_enabled(), reason="asks about machine code; SHELDRAKE_JIT=0 switches it off")

PAGE = (ROOT / "docs" / "own_laws.md").read_text(encoding="utf-8")
LAWS, MISTAKES = ([code for _, code in blocks(part)] for part in PAGE.split("## Mistakes\n"))
TIMES = """
import time
from sheldrake.common._native import store
for law in (duffing, energy, hinge_friction, hertz):
    start = time.process_time()
    store.make(law, tell=False)
    print(time.process_time() - start)
"""


@pytest.fixture(scope="module")
def run(tmp_path_factory):
    """Runs cells one after the other; gives the outputs of each, errors too."""
    nbformat, nbclient = pytest.importorskip("nbformat"), pytest.importorskip("nbclient")
    pytest.importorskip("ipykernel")

    def cells(*sources):
        notebook = nbformat.v4.new_notebook(cells=[nbformat.v4.new_code_cell(source) for source in sources])
        where = {"metadata": {"path": tmp_path_factory.mktemp("notebook")}}
        with pytest.MonkeyPatch.context() as patch:
            patch.setenv("PYTHONPATH", str(ROOT / "src"))
            nbclient.NotebookClient(notebook, timeout=300, resources=where, allow_errors=True).execute()
        return [cell.outputs for cell in notebook.cells]

    return cells


def errors(outputs):
    return [(o["ename"], o["evalue"]) for o in outputs if o["output_type"] == "error"]


def printed(outputs):
    return "".join(o["text"] for o in outputs if o["output_type"] == "stream" and o["name"] == "stdout")


def test_laws_compile_in_a_notebook_in_less_than_a_second_each(run):
    found = run(*LAWS, TIMES)
    assert [e for outputs in found for e in errors(outputs)] == []
    assert [float(text) < 1.0 for text in printed(found[-1]).split()] == [True] * 4


def test_a_cell_may_import_what_its_kernels_call(run):
    hinge = next(code for code in LAWS if "class Stribeck" in code)
    (outputs,) = run(f"{LAWS[0]}\n{hinge}\nfrom sheldrake.common._native import store\nstore.make(hinge_friction);")
    assert errors(outputs) == []


def test_errors_show_the_line_of_the_cell(run):
    contact = next(code for code in LAWS if "def hertz" in code)
    right, wrong = "depth = p.radius - u.p_WB[2]", "depth = p.radios - u.p_WB[2]"
    line = contact[: contact.index(right)].count("\n") + 1
    total = next(code for code in MISTAKES if "def total" in code).replace("said(total, x, y)", "total.bind(x, y)")
    simulation, bound = run(
        LAWS[0],
        contact.replace(right, wrong),
        "thrown([0, 0, 0]).AdvanceTo(0.1)",
        "x, y = np.ones(3), np.zeros(1)",
        total,
    )[2::2]
    ((kind, text),) = errors(simulation)
    place, _, said = text.partition(": ")
    assert kind == "KernelError" and place.endswith(f".py:{line}:{9 + 4}")
    assert said.splitlines()[:3] == [
        "hertz: Hertz has no field 'radios'; it has radius, stiffness, damping, friction, creep.",
        f"    {wrong}",
        "            ^^^^^^^^",
    ]
    ((kind, text),) = errors(bound)
    assert kind == "KernelError" and ".py:5:9: total: float is given to `s`" in text and "\n    s += x[i]\n" in text
