"""Tables of measured numbers in pages of the documentation."""

from __future__ import annotations

import pathlib

END = "<!-- end of the table -->"


def number(x: float | None) -> str:
    """As in a table: two digits, – for what was not measured."""
    if x is None:
        return "–"
    if x > 10.0:
        return "lost"
    if x < 1e-12:
        return "0"
    return f"{x:.1e}".replace("e-0", "e-") if x < 0.01 else f"{x:.2g}"


def replace_table(page: pathlib.Path, script: str, table: str) -> None:
    """Puts a table in the place of the one that a script wrote into a page before."""
    begin = f"<!-- table by benchmarks/{script}.py -->"
    before, rest = page.read_text(encoding="utf-8").split(begin)
    after = rest.split(END, 1)[1]
    page.write_text(f"{before}{begin}\n{table}\n{END}{after}", encoding="utf-8")
