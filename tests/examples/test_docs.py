"""The pages in docs/: their Python runs and gives what they say; their links lead somewhere; their commands exist."""

from __future__ import annotations

import os
import pathlib
import re
import subprocess
import sys

import pytest
from pages import PAGES, ROOT, Wrong, compare, run_page

COMMAND = re.compile(r"^(?:    |\$ )(?:python -m )?sheldrake ([a-z]\w*)(.*)$", re.MULTILINE)
LINK = re.compile(r"!?\[[^\]]*\]\(([^)\s]+)\)")


def headings(text):
    """Anchors of a page, as GitHub makes them."""
    text = re.sub(r"^```.*?^```", "", text, flags=re.DOTALL | re.MULTILINE)
    lines = re.findall(r"^#+ +(.*)$", text, re.MULTILINE)
    return {re.sub(r"[^\w\- ]", "", line.lower()).strip().replace(" ", "-") for line in lines}


@pytest.mark.parametrize("path", PAGES, ids=lambda path: path.stem)
def test_python_of_a_page_gives_what_it_says(path, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("MPLBACKEND", "Agg")
    if "as_pydrake" not in path.read_text(encoding="utf-8"):
        run_page(path)
        return
    environment = {**os.environ, "PYTHONPATH": str(ROOT / "src")}  # the alias is for a whole process
    command = [sys.executable, str(pathlib.Path(__file__).with_name("pages.py")), str(path)]
    done = subprocess.run(command, env=environment, capture_output=True, text=True, timeout=120, check=False)
    assert done.returncode == 0, done.stderr


def test_a_wrong_result_is_found(tmp_path):
    page = tmp_path / "page.md"
    page.write_text("```python\nx = 1.5\n```\n\n```python\nprint(2 * x)  # 3.2\n```\n")
    with pytest.raises(Wrong, match=r"page.md:6: says 3.2 but prints 3.0"):
        run_page(page)
    page.write_text("```python\nprint(3)\n```\n")
    with pytest.raises(Wrong, match="no comment"):
        run_page(page)
    page.write_text("```python\nprint([1, 2])\n# [1, 2]\n```\n")
    assert run_page(page) == 1


@pytest.mark.parametrize(
    ("expected", "got", "same"),
    [
        ("0.476 m", "0.4764 m", True),
        ("0.476 m", "0.4784 m", False),
        ("13 states", "13 states", True),
        ("13 states", "14 states", False),
        ("[1. 2.]", "[1.  2.]", True),
        ("at rest", "moving", False),
    ],
)
def test_numbers_are_compared_to_the_digits_said(expected, got, same):
    assert (compare(expected, got) == "") is same


@pytest.mark.parametrize("path", [*PAGES, *sorted(ROOT.glob("*.md"))], ids=lambda path: path.name)
def test_links_lead_somewhere(path):
    text = path.read_text(encoding="utf-8")
    for target in LINK.findall(text):
        if target.startswith(("http://", "https://", "mailto:")):
            continue
        file, _, anchor = target.partition("#")
        other = (path.parent / file).resolve() if file else path
        assert other.exists(), f"{path.name} links to {target}"
        if anchor and other.suffix == ".md":
            assert anchor in headings(other.read_text(encoding="utf-8")), f"{path.name} links to {target}"


@pytest.mark.parametrize("path", [*PAGES, ROOT / "README.md"], ids=lambda path: path.name)
def test_commands_exist_with_their_options(path, capsys):
    from sheldrake.cli import main

    for command, rest in COMMAND.findall(path.read_text(encoding="utf-8")):
        with pytest.raises(SystemExit) as ended:
            main([command, "--help"])
        text = capsys.readouterr().out
        assert ended.value.code == 0, command
        for option in re.findall(r"(?<=\s)--?[a-z][\w-]*", rest.partition(".py ")[0].partition("  ")[0]):
            assert option in text, f"{path.name}: sheldrake {command} has no {option}"


@pytest.mark.parametrize("path", PAGES, ids=lambda path: path.stem)
def test_every_page_is_reached_from_the_index(path):
    if path.stem != "index":
        assert f"({path.name})" in (ROOT / "docs" / "index.md").read_text(encoding="utf-8")


def test_names_of_the_cheat_sheet_and_the_guide_exist():
    from sheldrake import all as names
    from sheldrake import cad, export, report

    sheet = (ROOT / "docs" / "cheatsheet.md").read_text(encoding="utf-8")
    ours = "".join(re.findall(r"^\| (.*?) \|", sheet, re.MULTILINE))
    calls = re.findall(r"plant\.(\w+)", ours)
    assert len(calls) > 15
    for name in calls:
        assert hasattr(names.MultibodyPlant, name), name
    guide = (ROOT / "src" / "sheldrake" / "GUIDE.md").read_text(encoding="utf-8")
    table = guide[guide.index("| from |") : guide.index("## Ten idioms")]
    wanted = re.findall(r"`([A-Z]\w+)`", table) + re.findall(r"(?<![\w.])([A-Z][a-z]\w+)\(", ours)
    for name in wanted:
        assert any(hasattr(module, name) for module in (names, cad, export, report)), name


def test_gallery_shows_every_example():
    text = (ROOT / "docs" / "gallery.md").read_text(encoding="utf-8")
    for path in (ROOT / "examples").glob("*.py"):
        assert f"(../examples/{path.name})" in text
        assert f"(gallery/{path.stem}.webp)" in text


def test_pictures_are_small():
    for path in [*(ROOT / "docs").rglob("*.webp"), *(ROOT / "docs").rglob("*.png")]:
        assert path.stat().st_size < 60_000, path.name
