"""The changelog's fragments are joined by area, and none is lost."""

from __future__ import annotations

import re

import pytest
from pages import ROOT
from tools.join_changelog import AREAS, entries, join


def test_no_fragment_is_lost():
    text = join(ROOT / "changelog", "1.0")
    joined = re.sub(r"\s+", " ", text)
    for path in (ROOT / "changelog").glob("*.md"):
        if path.stem != "README":
            for item in entries(path.read_text(encoding="utf-8")):
                assert re.sub(r"\s+", " ", item) in joined, path.name


def test_areas_name_a_fragment_once():
    names = [name for names in AREAS.values() for name in names.split()]
    assert len(names) == len(set(names))


def test_entries_are_list_items(tmp_path):
    (tmp_path / "logs.md").write_text("- One\n  goes on.\n- Two.\n")
    (tmp_path / "zebra.md").write_text("Unknown topic,\nin two lines.\n")
    expected = (
        "## 2.0\n\n### Looking at it\n\n- One\n  goes on.\n- Two.\n\n### Also\n\n- Unknown topic,\n  in two lines.\n"
    )
    assert join(tmp_path, "2.0") == expected


def test_an_empty_fragment_is_an_error(tmp_path):
    (tmp_path / "nothing.md").write_text("\n")
    with pytest.raises(ValueError, match="nothing"):
        join(tmp_path, "2.0")
