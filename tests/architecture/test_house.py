"""The structure that the documents promise is the structure there is."""

from __future__ import annotations

import ast
import dataclasses
import importlib
import os
import pathlib
import pkgutil
import re
import subprocess
import sys

import numpy as np
import pytest
from scipy.sparse.csgraph import connected_components

import sheldrake

ROOT = pathlib.Path(__file__).resolve().parents[2]
SOURCE = ROOT / "src" / "sheldrake"
FILES = sorted(SOURCE.rglob("*.py"))
HEAVY = ("llvmlite", "scipy", "viser", "trimesh", "matplotlib", "rich", "sympy", "pandas")
PRIVATE_WORDS = re.compile(r"(?<![\w.])/(?:home|root|work|Users)/\w|\bpypi\.org")  # places of one machine, registries


def public_modules():
    names = [m.name for m in pkgutil.walk_packages([str(SOURCE)], "sheldrake.")]
    return sorted(n for n in names if not any(part.startswith("_") for part in n.split(".")))


def test_folder_map_of_the_architecture_page_is_true():
    page = (ROOT / "ARCHITECTURE.md").read_text(encoding="utf-8")
    table = page[page.index("| floor |") : page.index("Also:")]
    named = {n for row in table.splitlines()[2:] if row for n in re.findall(r"`([\w/.]+)`", row.split("|")[2])}
    assert named, "the table was found"
    for name in named:
        assert (SOURCE / name).exists(), f"ARCHITECTURE.md names {name}, which does not exist"
    folders = {
        p.relative_to(SOURCE).as_posix() for p in SOURCE.rglob("*") if p.is_dir() and (p / "__init__.py").exists()
    }
    unnamed = {f for f in folders if f.count("/") <= 1 and "_" not in pathlib.PurePosixPath(f).name[:1]}
    unnamed -= named | {f.split("/")[0] for f in named} | set(re.findall(r"`([\w/]+)`", page))
    assert not unnamed, f"ARCHITECTURE.md does not say what lives in {sorted(unnamed)}"


def unknown_names(page):
    """Returns files and names in backquotes that are nowhere in the package, its benchmarks and tools."""
    folders = (SOURCE, ROOT / "benchmarks", ROOT / "tools")
    texts = {p.as_posix(): p.read_text(encoding="utf-8") for folder in folders for p in folder.rglob("*.py")}
    files = {n for n in re.findall(r"`([\w/]+\.py)`", page) if not any(f"/{f}".endswith(f"/{n}") for f in texts)}
    words = set(re.findall(r"\w+", "\n".join(texts.values())))
    return files | (set(re.findall(r"`(\w+)`", page)) - words)


def test_decisions_name_what_is_there():
    page = (ROOT / "docs" / "decisions.md").read_text(encoding="utf-8")
    assert unknown_names(page) == {"nsz", "arcp"}  # LLVM's, and not used
    assert unknown_names("`common/gone.py`, `gone_for_good`, `common/kernel.py`") == {"common/gone.py", "gone_for_good"}


def test_parts_of_a_plant_are_those_of_the_architecture_page():
    page = (ROOT / "ARCHITECTURE.md").read_text(encoding="utf-8")
    table = page[page.index("| part | owns |") : page.index("A public call has one home")]
    named = {n for row in table.splitlines()[2:] if row for n in re.findall(r"`(\w+)`", row.split("|")[1])}
    tree = ast.parse((SOURCE / "multibody" / "plant" / "_parts.py").read_text(encoding="utf-8"))
    (made,) = (n for n in ast.walk(tree) if isinstance(n, ast.FunctionDef) and n.name == "__init__")
    parts = {t.attr for n in made.body if isinstance(n, ast.Assign) for t in n.targets if isinstance(t, ast.Attribute)}
    # The plant itself and the sign of its family are no parts; the others are classes of which parts have one.
    assert parts - {"plant", "family"} == named - {
        "freeze",
        "FrozenModel",
        "View",
        "DiscreteUpdate",
        "ContinuousDynamics",
    }


@pytest.mark.parametrize("module", public_modules())
def test_public_lists_are_true(module):
    if module.endswith(("__main__", "as_pydrake")):
        pytest.skip("importing this module acts: it runs the command line, or installs the alias")
    loaded = importlib.import_module(module)
    for name in getattr(loaded, "__all__", ()):
        assert hasattr(loaded, name), f"{module}.__all__ names {name}, which it does not have"


def test_importing_is_light():
    """`import sheldrake` and its floors load none of the heavy libraries."""
    code = "import sys\n" + "\n".join(
        f"import {m}" for m in public_modules() if not m.endswith(("__main__", "as_pydrake", "all"))
    )
    code += f"\nprint(sorted(set({HEAVY!r}) & set(sys.modules)))"
    env = {**os.environ, "PYTHONPATH": str(ROOT / "src")}
    out = subprocess.run([sys.executable, "-c", code], env=env, capture_output=True, text=True, check=True).stdout
    assert out.strip() == "[]"


ONLY_A_COMPILER = """
import sys
class Refuse:
    def find_spec(self, name, path=None, target=None):
        if name.partition(".")[0] not in sys.stdlib_module_names | {"sheldrake", "numpy", "llvmlite"}:
            raise ModuleNotFoundError(f"No module named {name!r}", name=name)
sys.meta_path.insert(0, Refuse())
from sheldrake.common._native.build import entries
print(len(entries()))
"""


def test_kernels_are_found_where_wheels_are_built():
    """pip builds a wheel with NumPy and llvmlite alone; what is not found there is not in the library."""
    from sheldrake.common._native.build import entries

    tree = ast.parse((ROOT / "tools" / "build_backend.py").read_text(encoding="utf-8"))
    (compiler,) = (ast.literal_eval(n.value) for n in tree.body if isinstance(n, ast.Assign))
    assert {requirement.partition(">")[0] for requirement in compiler} == {"numpy", "llvmlite", "ziglang"}
    env = {**os.environ, "PYTHONPATH": str(ROOT / "src")}
    out = subprocess.run([sys.executable, "-c", ONLY_A_COMPILER], env=env, capture_output=True, text=True, check=False)
    assert out.returncode == 0, out.stderr
    assert int(out.stdout) == len(entries()) > 60


def kernels_of(path):
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.FunctionDef):
            for decorator in node.decorator_list:
                target = decorator.func if isinstance(decorator, ast.Call) else decorator
                if isinstance(target, ast.Name) and target.id == "kernel":
                    yield node, decorator


@pytest.mark.parametrize("path", FILES, ids=lambda path: path.relative_to(SOURCE).as_posix())
def test_a_module_says_what_it_is(path):
    """A docstring in words, not only a name."""
    said = ast.get_docstring(ast.parse(path.read_text(encoding="utf-8"))) or ""
    assert " " in said, "says nothing, or only its name"


@pytest.mark.parametrize("path", FILES, ids=lambda path: path.relative_to(SOURCE).as_posix())
def test_functions_are_short(path):
    """60 lines are what we aim at; beyond this limit there are two things in one place. Files are as long as needed."""
    source = path.read_text(encoding="utf-8")
    long = [
        node.name
        for node in ast.walk(ast.parse(source))
        if isinstance(node, ast.FunctionDef) and node.end_lineno - node.lineno >= 80
    ]
    assert not long, f"functions of more than 80 lines: {long}"


def test_annotations_say_what_values_are():
    """`Any` is for what may be of any type: what ports, options and files of others carry."""
    said = [re.findall(r": Any|-> Any", path.read_text(encoding="utf-8")) for path in [*FILES, *SOURCE.rglob("*.pyi")]]
    assert sum(map(len, said)) <= 2_500


def test_no_alias_hides_any():
    aliases = re.compile(r"^\w+(?:: TypeAlias)? = \"?Any\"?$", re.MULTILINE)
    assert not [path.name for path in FILES if aliases.search(path.read_text(encoding="utf-8"))]


FORBIDDEN = (ast.Try, ast.Raise, ast.With, ast.Lambda, ast.ListComp, ast.GeneratorExp, ast.DictComp, ast.List, ast.Dict,
             ast.JoinedStr, ast.Global, ast.FunctionDef, ast.ClassDef, ast.Starred)  # fmt: skip


@pytest.mark.parametrize("path", [p for p in FILES if "@kernel" in p.read_text(encoding="utf-8")], ids=str)
def test_kernel_grammar(path):
    """Kernels allocate nothing, raise nothing, take no defaults, and slice nothing."""
    for node, decorator in kernels_of(path):
        where = f"{path.relative_to(SOURCE)}:{node.name}"
        assert not node.args.defaults, f"{where} has default arguments"
        assert not node.args.vararg, f"{where} takes a variable number of arguments"
        for inner in ast.walk(node):
            if inner is not node:
                assert not isinstance(inner, FORBIDDEN), f"{where} line {inner.lineno}: {type(inner).__name__}"
            assert not isinstance(inner, ast.Slice), f"{where}: an array is passed whole"
            if isinstance(inner, ast.Subscript):
                negative = isinstance(inner.slice, ast.UnaryOp) and isinstance(inner.slice.op, ast.USub)
                assert not negative, f"{where} line {inner.lineno}: compiled indices do not count from the end"
        if isinstance(decorator, ast.Call) and any(k.arg == "top" for k in decorator.keywords):
            missing = [a.arg for a in node.args.args if a.annotation is None]
            assert not missing, f"{where}: an entry annotates its parameters; {missing} are not"


def test_kernel_modules_import_only_kernels():
    allowed = re.compile(
        r"^(numpy|math|typing|__future__|sheldrake\.common\.(kernel|record|rows)|sheldrake(\.\w+)*\._kernels(\.\w+)*)$"
    )
    for path in FILES:
        if "_kernels" not in path.parts:
            continue
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            names = [a.name for a in node.names] if isinstance(node, ast.Import) else []
            if isinstance(node, ast.ImportFrom):
                folder = ".".join(("sheldrake", *path.relative_to(SOURCE).parts[: -node.level or None])) + "."
                names = [f"{folder if node.level else ''}{node.module}"]
            for name in names:
                if path.relative_to(SOURCE).as_posix() == "common/_kernels/generic.py":
                    continue  # where the generic maths is made
                assert allowed.match(name), f"{path.relative_to(SOURCE)} imports {name}"


CIRCLES = {
    "common._native": "a kernel is bound by what compiles it, which looks at the kernels that it calls",
    "systems.framework": "a store makes the contexts of its systems when somebody asks for one",
}
"""The packages in which modules need each other while they run, each with the reason."""


def imports_of(path):
    """Modules of sheldrake that a module imports when it is loaded or while it runs, not for annotations alone."""
    nodes = list(ast.parse(path.read_text(encoding="utf-8")).body)
    while nodes:
        node = nodes.pop()
        if isinstance(node, ast.If) and "TYPE_CHECKING" in ast.dump(node.test):
            continue
        nodes += ast.iter_child_nodes(node)
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            above = path.relative_to(SOURCE.parent).parts[: -node.level or None] if node.level else ()
            base = ".".join((*above, *filter(None, [node.module])))
            yield from (name for alias in node.names for name in (base, f"{base}.{alias.name}"))


def circles():
    """Sets of modules that reach each other by imports."""
    names = {".".join(p.relative_to(SOURCE.parent).with_suffix("").parts).removesuffix(".__init__"): p for p in FILES}
    at = {name: i for i, name in enumerate(names)}
    edges = np.zeros((len(names), len(names)))
    for name, path in names.items():
        found = {i for i in imports_of(path) if i in names} - {name}
        # `from package import module` imports the module, not what else the package's `__init__` does.
        edges[at[name], [at[i] for i in found if not any(j.startswith(f"{i}.") for j in found)]] = 1.0
    count, circle_of = connected_components(edges, connection="strong")
    members = [[name for name in names if circle_of[at[name]] == k] for k in np.flatnonzero(np.bincount(circle_of) > 1)]
    assert count > 500, "nearly every module is in no circle"
    return members


def test_circles_of_imports_are_those_written_down():
    found = circles()
    where = [k for circle in found for k in CIRCLES if any(name.startswith(f"sheldrake.{k}.") for name in circle)]
    assert len(found) == len(CIRCLES) and sorted(where) == sorted(CIRCLES), f"circles of imports: {found}"


def test_the_repository_speaks_of_the_project_alone():
    tracked = subprocess.run(["git", "ls-files"], cwd=ROOT, capture_output=True, text=True, check=False).stdout.split()
    assert tracked or not (ROOT / ".git").exists()
    for name in tracked:
        path = ROOT / name
        if path.suffix in {".py", ".md", ".toml", ".lock", ".yml", ".urdf", ".txt"} and path != pathlib.Path(__file__):
            found = PRIVATE_WORDS.search(path.read_text(encoding="utf-8"))
            assert not found, f"{name} says {found.group()!r}"


def test_public_things_have_docstrings():
    missing = []
    for module in public_modules():
        if module.endswith(("__main__", "as_pydrake", "all")):
            continue
        loaded = importlib.import_module(module)
        for name in getattr(loaded, "__all__", ()):
            thing = getattr(loaded, name)
            if callable(thing) and getattr(thing, "__module__", "").startswith("sheldrake") and not thing.__doc__:
                missing.append(f"{module}.{name}")
    assert not missing, f"without a docstring: {missing}"


def test_public_classes_say_where_they_are_public():
    found = []
    for module in public_modules():
        if module == "sheldrake.as_pydrake":
            continue  # imported, it makes `pydrake` mean sheldrake in this process
        loaded = importlib.import_module(module)
        for name in getattr(loaded, "__all__", ()):
            thing = vars(loaded).get(name)
            if isinstance(thing, type) and thing.__module__.startswith(f"{module}._"):
                if not dataclasses.is_dataclass(thing):  # whose annotations are names of its file
                    found.append(f"{module}.{name}: {thing.__module__}")
    assert not found, f"of a private file, for those who read their names: {found}"


def test_version_is_said_once():
    assert f'version = "{sheldrake.__version__}"' in (ROOT / "pyproject.toml").read_text(encoding="utf-8")


def test_names_of_test_files_are_unique():
    """pytest imports a test file by its name alone: of two with one name, the second would not run."""
    names = [p.name for p in (ROOT / "tests").rglob("*.py") if p.name not in ("__init__.py", "conftest.py")]
    assert sorted(names) == sorted(set(names))
