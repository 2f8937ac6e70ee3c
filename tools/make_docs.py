"""Makes the site of the documentation: `python tools/make_docs.py [OUT]`, by default build/docs.

Gathers the pages of docs/, a page for each example and for each public module, the tutorial as a notebook, and lets
Sphinx make HTML of them. A link that leads nowhere is an error. Needs the extra `docs`; no network.
"""

from __future__ import annotations

import ast
import os
import pathlib
import re
import shutil
import subprocess
import sys
import tempfile

ROOT = pathlib.Path(__file__).resolve().parents[1]
DOCS = ROOT / "docs"
PROJECT = {
    "src/sheldrake/GUIDE.md": "guide",
    "CHANGELOG.md": "changes",
    "ARCHITECTURE.md": "architecture",
    "CONTRIBUTING.md": "contributing",
}
"""Pages from elsewhere in the repository, and their names in the site."""

EXAMPLES = ROOT / "examples"
LIVE = ("arm_pid", "bouncing_ball", "cart_pole_lqr", "clutter", "double_pendulum", "drop_the_block", "gripper",
        "gyroscope", "pendulum", "quadruped", "soft_ball", "stack")  # fmt: skip
"""Examples that are simulated in their pages; the others are about what a page has not."""
TUTORIAL = "tutorial"
MARK = "<!-- live: {} -->"
"""Where a page has a simulation that runs in the browser."""

FOR_PROGRAMS = """\
# sheldrake

> Drake's modelling system for robots in pure Python with compiled kernels: systems, contexts, diagrams, multibody
> dynamics, contact, planning, a viewer in the browser. Names, arguments and numbers are pydrake's.

`pip install ".[kernels]"` in a clone; `from sheldrake.all import ...`. Begin with the guide; `sheldrake guide` shows
it from the installed package, where `sheldrake/all.pyi` has the types of all public names. Python in these pages is run
by tests. All pages in one file: [llms-full.txt](llms-full.txt).

## Guide

- [Ten idioms](_sources/guide.md.txt): what to import, how to read errors, what differs from pydrake and MuJoCo
"""


def toctrees(index: str) -> str:
    """Returns the site's menu: a hidden table of contents for each section of the index, in its order."""
    sections = re.findall(r"^## (.*?)\n(.*?)(?=^## |\Z)", index, re.DOTALL | re.MULTILINE)
    menus = [(title, re.findall(r"\]\((\w+)\.md\)", text)) for title, text in sections]
    menus.append(("Reference", ["api/index", *PROJECT.values()]))
    return "".join(
        "\n".join(["", "```{toctree}", ":hidden:", f":caption: {title}", *pages, "```", ""]) for title, pages in menus
    )


def llms_text(index: str) -> str:
    """Returns llms.txt: what programs that write programs are told about the library, and where each page's text is."""
    rows = re.compile(r"^\| \[(.*?)\]\((\w+)\.md\) \| (.*?) \|$", re.MULTILINE)
    text = FOR_PROGRAMS
    for title, section in re.findall(r"^## (.*?)\n(.*?)(?=^## |\Z)", index, re.DOTALL | re.MULTILINE):
        text += f"\n## {title}\n\n"
        text += "".join(f"- [{name}](_sources/{page}.md.txt): {about}\n" for name, page, about in rows.findall(section))
    reference = "every public module, class and function, with units and errors"
    return f"{text}\n## Reference\n\n- [Reference](api/index.html): {reference}\n"


def write_llms(out: pathlib.Path) -> None:
    """Writes llms.txt and llms-full.txt, which holds the guide and all pages of the index, into a site."""
    index = (DOCS / "index.md").read_text(encoding="utf-8")
    pages = [ROOT / "src" / "sheldrake" / "GUIDE.md"]
    pages += [DOCS / f"{name}.md" for name in re.findall(r"\]\((\w+)\.md\)", index)]
    (out / "llms.txt").write_text(llms_text(index), encoding="utf-8")
    whole = "\n\n".join(path.read_text(encoding="utf-8") for path in pages)
    (out / "llms-full.txt").write_text(whole, encoding="utf-8")


def example_page(path: pathlib.Path) -> str:
    """Returns the page of an example: what it is about, the example as it runs or its picture, its source."""
    text = path.read_text(encoding="utf-8")
    about = ast.get_docstring(ast.parse(text)) or ""
    shown = MARK.format(path.stem) if path.stem in LIVE else f"![{path.stem}](../gallery/{path.stem}.webp)"
    title = f"# {path.name}\n\n{about}\n\n{shown}\n\n"
    return f"{title}{{download}}`{path.name}`\n\n```python\n{text}```\n"


def whole_numbers(text: str) -> str:
    """Returns a page whose tables have minus signs in exponents: at a hyphen a browser breaks the line."""
    return re.sub(r"^\|.*$", lambda row: re.sub(r"(?<=\de)-(?=\d)", "\u2212", row[0]), text, flags=re.MULTILINE)


def stage(source: pathlib.Path) -> None:
    """Gathers all that Sphinx reads in a folder."""
    import api_pages
    import join_changelog
    import make_notebook

    shutil.rmtree(source, ignore_errors=True)
    shutil.copytree(DOCS, source)
    (source / "examples").mkdir()
    for path in sorted((ROOT / "examples").glob("*.py")):
        shutil.copy(path, source / "examples")
        (source / "examples" / f"{path.stem}.md").write_text(with_live(example_page(path), "../"), encoding="utf-8")
    for name, page in PROJECT.items():
        shutil.copy(ROOT / name, source / f"{page}.md")
    coming = join_changelog.join(ROOT / "changelog", "Change by change")
    with open(source / "changes.md", "a", encoding="utf-8") as file:
        file.write("\n" + coming)
    for path in source.glob("*.md"):
        text = path.read_text(encoding="utf-8")
        text = re.sub(r"\]\(\.\./examples/(\w+)\.py\)", r"](examples/\1.md)", text)
        text = text.replace("](docs/", "](")  # pages from the root of the repository lie beside the others here
        text = with_live(text)
        path.write_text(whole_numbers(text), encoding="utf-8")
    with open(source / "gallery.md", "a", encoding="utf-8") as file:
        file.write("\n```{toctree}\n:hidden:\n:glob:\nexamples/*\n```\n")
    with open(source / "index.md", "a", encoding="utf-8") as file:
        file.write(toctrees((DOCS / "index.md").read_text(encoding="utf-8")))
    tutorial = source / "tutorial.md"
    text = tutorial.read_text(encoding="utf-8")
    make_notebook.main(str(tutorial), str(source / "tutorial.ipynb"))
    title, _, rest = text.partition("\n")
    tutorial.write_text(f"{title}\n\n{{download}}`This page as a notebook <tutorial.ipynb>`\n{rest}", encoding="utf-8")
    api_pages.write(source / "api")


def with_live(text: str, up: str = "") -> str:
    """Returns a page with what runs in the browser where its marks are; `up` leads to the site's root."""

    def framed(mark: re.Match) -> str:
        name = mark[1]
        frame = f'<iframe class="live" src="{up}live/{name}.html" title="Simulation: {name}" loading="lazy"></iframe>'
        return f"```{{raw}} html\n{frame}\n```"

    return re.sub(re.escape(MARK).replace(r"\{\}", r"(\w+)"), framed, text)


def write_live(out: pathlib.Path) -> None:
    """Writes the pages that simulate: of examples, and of the tutorial's code.

    Raises:
        RuntimeError: one cannot leave Python; it has the words of `sheldrake page`.
    """
    import make_notebook

    out.mkdir()
    scripts = {name: EXAMPLES / f"{name}.py" for name in LIVE}
    with tempfile.TemporaryDirectory() as folder:
        scripts[TUTORIAL] = pathlib.Path(folder) / f"{TUTORIAL}.py"
        code = make_notebook.BLOCK.findall((DOCS / f"{TUTORIAL}.md").read_text(encoding="utf-8"))
        scripts[TUTORIAL].write_text("\n".join(code), encoding="utf-8")
        for name, script in scripts.items():
            command = [sys.executable, "-m", "sheldrake", "page", "-o", str(out / f"{name}.html"), str(script)]
            command += ["--headless"] if name in LIVE else []
            environment = {**os.environ, "PYTHONPATH": str(ROOT / "src")}
            done = subprocess.run(command, cwd=folder, env=environment, capture_output=True, text=True, check=False)
            if done.returncode != 0:
                raise RuntimeError(f"{name} has no page that simulates: {done.stderr.strip()[-2000:]}")


def serious(warning: str) -> bool:
    """Whether a warning is a fault of the site, such as a broken link; the form of a docstring only looks bad."""
    of_a_docstring = ":docstring of " in warning or "/source/api/" in warning
    return bool(warning.strip()) and not (of_a_docstring and "[docutils]" in warning)


def make(out: pathlib.Path) -> int:
    """Writes the site into OUT/html; returns 0, or another status when it has faults."""
    from sphinx.cmd.build import build_main

    stage(out / "source")
    warnings = out / "warnings.txt"
    options = ["--quiet", "--builder", "html", "--doctree-dir", str(out / "trees"), "--warning-file", str(warnings)]
    status = build_main([*options, str(out / "source"), str(out / "html")])
    if status == 0:
        write_llms(out / "html")
        shutil.rmtree(out / "html" / "live", ignore_errors=True)
        write_live(out / "html" / "live")
    return status or int(any(map(serious, warnings.read_text(encoding="utf-8").splitlines())))


def main() -> int:
    """Makes the site and says where it is."""
    out = pathlib.Path(sys.argv[1] if len(sys.argv) > 1 else ROOT / "build" / "docs").resolve()
    status = make(out)
    print(f"{out / 'html' / 'index.html'}" if status == 0 else "the site has faults", flush=True)
    return status


if __name__ == "__main__":
    sys.path[:0] = [str(ROOT / "src"), str(ROOT / "tools")]
    os.environ.setdefault("MPLBACKEND", "Agg")
    sys.exit(main())
