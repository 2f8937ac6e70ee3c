"""The site of the documentation: it is made without a warning, its links lead somewhere, it needs no network."""

from __future__ import annotations

import html.parser
import inspect
import pathlib
import re
import subprocess
import sys
import urllib.parse

import pytest
from pages import PAGES, ROOT

OUTSIDE = ("http://", "https://", "//")


class Page(html.parser.HTMLParser):
    """What a page links to, what it loads, and what in it can be linked to."""

    def __init__(self, text):
        super().__init__()
        self.links, self.loads, self.anchors = [], [], set()
        self.feed(text)

    def handle_starttag(self, tag, attributes):
        found = dict(attributes)
        self.anchors.add(found.get("id"))
        if tag == "a" and "href" in found:
            self.links.append(found["href"])
        if tag in ("img", "script", "iframe", "source") and "src" in found:
            self.loads.append(found["src"])
        if tag == "link" and found.get("rel") in ("stylesheet", "icon", "preload"):
            self.loads.append(found["href"])


def faults(folder):
    """Returns what is wrong with a site: links to nowhere, and what would be loaded from another machine."""
    pages = {path.resolve(): Page(path.read_text(encoding="utf-8")) for path in pathlib.Path(folder).rglob("*.html")}
    found = []
    for path, page in pages.items():
        found += [f"{path.name} loads {url}" for url in page.loads if url.startswith(OUTSIDE)]
        for url in [*page.links, *page.loads]:
            if url.startswith((*OUTSIDE, "mailto:", "data:")):
                continue
            file, _, anchor = urllib.parse.unquote(url).partition("#")
            target = (path.parent / file.partition("?")[0]).resolve() if file else path
            if not target.exists():
                found.append(f"{path.name} links to {url}")
            elif anchor and target in pages and anchor not in pages[target].anchors:
                found.append(f"{path.name} links to {url}: no such place")
    return found


@pytest.mark.parametrize(
    ("warning", "is_serious"),
    [
        ("docs/source/contact.md:3: WARNING: 'myst' cross-reference target not found: 'x' [myst.xref_missing]", True),
        ("src/a.py:docstring of sheldrake.a:3: ERROR: Unexpected indentation. [docutils]", False),
        ("docs/source/contact.md:9: ERROR: Unknown directive type. [docutils]", True),
        ("", False),
    ],
)
def test_a_broken_link_is_serious_and_the_form_of_a_docstring_is_not(warning, is_serious):
    from tools.make_docs import serious

    assert serious(warning) is is_serious


def test_docstrings_are_prose():
    from tools.api_pages import as_prose

    assert as_prose("|x| of RgbdSensor_, with `a|b_` and *args") == r"\|x\| of RgbdSensor\_, with `a|b_` and \*args"


def test_signatures_say_what_a_parameter_is_or_nothing():
    from tools.api_pages import shorter

    assert shorter("(i: int, selector: ~typing.Any = None)") == "(i: int, selector = None)"
    assert shorter("(*args: Any, **kwargs: Any)") == "(...)"
    assert shorter("~typing.Any") is None
    assert shorter("ContactResults | None") == "ContactResults | None"


def test_numbers_of_tables_are_not_broken_at_a_hyphen():
    from tools.make_docs import whole_numbers

    assert whole_numbers("1e-5\n| one-point | 4.9e-6 |\n") == "1e-5\n| one-point | 4.9e\u22126 |\n"


@pytest.fixture(scope="module")
def site(tmp_path_factory):
    for needed in ("sphinx", "furo", "myst_parser"):
        pytest.importorskip(needed)
    out = tmp_path_factory.mktemp("docs")
    command = [sys.executable, str(ROOT / "tools" / "make_docs.py"), str(out)]
    done = subprocess.run(command, capture_output=True, text=True, timeout=900, check=False)
    assert done.returncode == 0, done.stdout + done.stderr
    return out / "html"


def test_links_lead_somewhere_and_nothing_is_loaded_from_elsewhere(site):
    assert faults(site) == []


def test_every_public_name_has_its_place_in_the_reference(site):
    from tools.api_pages import public_classes, public_modules

    modules = public_modules()
    classes = public_classes(modules)
    pages = {path.stem: Page(path.read_text(encoding="utf-8")) for path in (site / "api").glob("*.html")}
    for module in modules:
        for name in module.__all__:
            thing, place = getattr(module, name), f"{module.__name__}.{name}"
            place = classes[thing] if inspect.isclass(thing) else place
            assert place in pages[place.rpartition(".")[0]].anchors, place


def test_methods_of_a_class_made_of_parts_are_in_the_reference(site):
    page = Page((site / "api" / "sheldrake.multibody.plant.html").read_text(encoding="utf-8"))
    for name in ("Finalize", "AddRigidBody", "CalcMassMatrix", "SetFreeBodyPose", "get_contact_results_output_port"):
        assert f"sheldrake.multibody.plant.MultibodyPlant.{name}" in page.anchors


def test_programs_find_the_text_of_every_page(site):
    text = (site / "llms.txt").read_text(encoding="utf-8")
    assert text.startswith("# sheldrake\n\n> ")
    named = re.findall(r"\]\((.*?)\)", text)
    assert {f"_sources/{path.stem}.md.txt" for path in PAGES if path.stem != "index"} <= set(named)
    for name in named:
        assert (site / name).exists(), name
    assert "Ten idioms" in (site / "llms-full.txt").read_text(encoding="utf-8")


def test_scenes_run_in_the_pages_of_the_tutorial_and_the_examples(site):
    from tools.make_docs import LIVE, TUTORIAL

    for name, page in [(TUTORIAL, site / "tutorial.html"), *((n, site / "examples" / f"{n}.html") for n in LIVE)]:
        (frame,) = re.findall(r'<iframe class="live" src="(.*?)"', page.read_text(encoding="utf-8"))
        text = (page.parent / frame).resolve().read_text(encoding="utf-8")
        assert frame.endswith(f"live/{name}.html") and 'id="play"' in text
    shown = {path.stem for path in (site / "examples").glob("*.html") if "iframe" in path.read_text(encoding="utf-8")}
    assert shown == set(LIVE)
    assert "live:" not in (site / "tutorial.html").read_text(encoding="utf-8")


IN_PYTHON = """
from sheldrake.all import *


class Pacer(LeafSystem):
    def __init__(self):
        LeafSystem.__init__(self)
        self.DeclareVectorOutputPort("step", 1, lambda context, output: output.SetFromVector([context.get_time()]))


builder = DiagramBuilder()
LogVectorOutput(builder.AddNamedSystem("pacer", Pacer()).get_output_port(), builder, 0.1)
Simulator(builder.Build()).AdvanceTo(1.0)
"""


def test_a_script_that_cannot_leave_python_stops_the_site(tmp_path, monkeypatch):
    from tools import make_docs

    (tmp_path / "pacer.py").write_text(IN_PYTHON)
    monkeypatch.syspath_prepend(ROOT / "tools")
    monkeypatch.setattr(make_docs, "EXAMPLES", tmp_path)
    monkeypatch.setattr(make_docs, "LIVE", ("pacer",))
    with pytest.raises(RuntimeError, match=r"(?s)pacer has no page that simulates: .*Pacer"):
        make_docs.write_live(tmp_path / "live")


def test_the_site_stays_small(site):
    assert sum(path.stat().st_size for path in site.rglob("*") if path.is_file()) < 40e6


@pytest.mark.parametrize(
    ("body", "fault"),
    [
        ('<a href="other.html">', "links to other.html"),
        ('<a href="#here">', "no such place"),
        ('<script src="https://example.com/x.js">', "loads https://example.com/x.js"),
        ('<p id="here"></p><a href="page.html#here">', None),
    ],
)
def test_a_broken_link_is_found(tmp_path, body, fault):
    (tmp_path / "page.html").write_text(body)
    found = faults(tmp_path)
    assert len(found) == (fault is not None)
    assert fault is None or fault in found[0]
