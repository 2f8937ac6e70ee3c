"""Makes a Jupyter notebook of a page: `python tools/make_notebook.py docs/tutorial.md tutorial.ipynb`.

Python blocks become code cells, in their order; what is between them becomes text. A notebook travels alone: pictures
stay behind, and links to other pages become their words.
"""

from __future__ import annotations

import json
import pathlib
import re
import sys

BLOCK = re.compile(r"^```python\n(.*?)^```\n?", re.DOTALL | re.MULTILINE)
PICTURE = re.compile(r"^!\[.*\n+", re.MULTILINE)
LINK = re.compile(r"\[([^\]]*)\]\((?!https?:)[^)]*\)")


def cells(page: str) -> list[dict]:
    """Returns the cells of a page in Markdown."""
    found = []
    for k, part in enumerate(BLOCK.split(page)):
        text = (part if k % 2 else LINK.sub(r"\1", PICTURE.sub("", part))).strip("\n")
        if not text:
            continue
        cell = {"cell_type": "code" if k % 2 else "markdown", "id": f"cell-{k}", "metadata": {}}
        cell |= {"execution_count": None, "outputs": []} if k % 2 else {}
        found.append({**cell, "source": text.splitlines(keepends=True)})
    return found


def notebook(page: str) -> dict:
    """Returns a notebook in version 4.5 of Jupyter's format."""
    kernel = {"display_name": "Python 3", "language": "python", "name": "python3"}
    metadata = {"kernelspec": kernel, "language_info": {"name": "python"}}
    return {"cells": cells(page), "metadata": metadata, "nbformat": 4, "nbformat_minor": 5}


def main(source: str, target: str) -> None:
    """Writes the notebook of a page."""
    page = pathlib.Path(source).read_text(encoding="utf-8")
    pathlib.Path(target).write_text(json.dumps(notebook(page), indent=1, ensure_ascii=False) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main(*sys.argv[1:])
