"""Lists where sheldrake's public surface differs from that of an installed pydrake, beyond names.

    python tools/compare_with_pydrake.py [module prefix]     # such as sheldrake.multibody
    python tools/compare_with_pydrake.py --stubs drake-1.58.0-cp312-abi3-manylinux_2_34_x86_64.whl [module prefix]

For every class and function: the calls that pydrake's overloads allow (all by position, all by name, only what has no
default), literal defaults, static methods, properties and which can be set, enum members, bases, operators, and the
instantiations of templates. pydrake's side is read from the signatures at the heads of its docstrings. With `--stubs`
it is read from the `.pyi` files of a wheel, or of a folder, of a version that need not be installed: then missing
modules and names are listed too, and instantiations are not.
Differences that stay are in `known_differences.txt` beside this file, each with a reason; the rest is printed.
"""

from __future__ import annotations

import argparse
import ast
import contextlib
import fnmatch
import functools
import importlib
import inspect
import pathlib
import pkgutil
import re
import sys
import warnings
import zipfile
from collections.abc import Iterable, Iterator
from types import ModuleType
from typing import Any, NamedTuple

KNOWN = pathlib.Path(__file__).with_name("known_differences.txt")
OPERATORS = (
    "__add__ __radd__ __sub__ __rsub__ __mul__ __rmul__ __matmul__ __truediv__ "
    "__rtruediv__ __pow__ __rpow__ __neg__ __pos__ __abs__ __eq__ __lt__ __le__ __gt__ __ge__ "
    "__bool__ __int__ __float__ __index__ __len__ __getitem__ __setitem__ __contains__ __iter__ __call__ __str__ "
    "__and__ __or__ __invert__ __enter__ __exit__"
).split()


class Parameter(NamedTuple):
    """One parameter of an overload: `name` is empty when it has none that a caller can use."""

    name: str
    default: str | None
    keyword_only: bool


class Overload(NamedTuple):
    """One way of calling a function of pydrake, without `self`."""

    text: str
    parameters: list[Parameter]
    open_ended: bool


def split(text: str, separator: str = ",") -> list[str]:
    """Splits at separators that stand outside brackets and quotes."""
    parts, depth, quote, start = [], 0, "", 0
    for at, char in enumerate(text):
        if quote:
            quote = "" if char == quote else quote
        elif char in "'\"":
            quote = char
        elif char in "([{":
            depth += 1
        elif char in ")]}" or (char == ">" and text[at - 1] != "-" and depth and "<" in text[start:at]):
            depth -= 1
        elif char == "<":
            depth += 1
        elif char == separator and depth == 0:
            parts.append(text[start:at].strip())
            start = at + 1
    return [*parts, last] if (last := text[start:].strip()) else parts


def overload(text: str) -> Overload | None:
    """Reads one line of a docstring: `Name(self: Foo, x: float = 1.0, *, y: int) -> None`."""
    head = re.match(r"\w+\((.*)\)(?: -> .*)?$", text)
    if not head:
        return None
    parameters, open_ended, keyword_only = [], False, False
    for part in split(head.group(1)):
        if part == "*":
            keyword_only = True
        elif part.startswith("*"):
            open_ended = True
        elif part != "/":
            declaration, *default = split(part, "=")
            name = declaration.partition(":")[0].strip()
            if name == "self" and not parameters:
                continue
            is_named = not re.fullmatch(r"arg\d+", name)
            parameters.append(Parameter(name if is_named else "", default[0] if default else None, keyword_only))
    return Overload(text, parameters, open_ended)


def overloads(function: Any) -> list[Overload]:
    """What the docstring of a function of pydrake says about calling it; empty for one written in Python."""
    lines = (function.__doc__ or "").splitlines()
    if len(lines) > 1 and lines[1] == "Overloaded function.":
        texts = []
        for line in lines:
            if line.startswith(f"{len(texts) + 1}. "):
                texts.append(line.partition(" ")[2])
    else:
        texts = lines[:1]
    return [o for o in map(overload, texts) if o is not None and not is_retired(function, o)]


def is_retired(function: Any, one: Overload) -> bool:
    """Whether the docstring says of an overload that it is deprecated."""
    after = (function.__doc__ or "").partition(one.text)[2]
    return re.match(r"\s*\(Deprecated\.?\)", after) is not None


def native_signature(function: Any) -> inspect.Signature | None:
    """sheldrake's signature without `self`."""
    try:
        return inspect.signature(function)
    except (TypeError, ValueError):
        return None


def literal(text: str) -> Any:
    """The value of a default in a docstring, or `...` when it is no literal."""
    if enum := re.fullmatch(r"<[\w.]+\.(\w+): -?\d+>", text):
        return enum.group(1)
    try:
        return ast.literal_eval(text)
    except (ValueError, SyntaxError):
        return float(text) if text in ("inf", "nan", "-inf") else ...


def same_default(theirs: str, ours: Any) -> bool:
    """Whether two defaults are equal, as far as a docstring tells."""
    value = literal(theirs)
    if value is ...:
        return ours is not inspect.Parameter.empty
    if isinstance(value, str) and hasattr(ours, "name") and not isinstance(ours, str):
        return bool(ours.name == value)
    if ours is None or value is None:
        return ours is value or ours is ...  # None often stands for a default that is made at the call.
    try:
        return (value != value and ours != ours) or bool(value == ours) or list(value) == list(ours)
    except TypeError:
        return False


def call_faults(signature: inspect.Signature, one: Overload, source: str) -> Iterator[str]:
    """What is wrong with calling by this overload."""
    if one.open_ended:
        return
    by_position = [p for p in one.parameters if not p.keyword_only]
    by_name = {p.name: ... for p in one.parameters if p.keyword_only}
    needed = [p for p in by_position if p.default is None]
    ways: list[tuple[str, list, dict]] = [
        ("by position", [...] * len(by_position), by_name),
        (
            "without defaults",
            [...] * len(needed),
            {p.name: ... for p in one.parameters if p.keyword_only and not p.default},
        ),
    ]
    if all(p.name for p in one.parameters):
        ways.append(("by name", [], {p.name: ... for p in one.parameters}))
    for way, args, kwargs in ways:
        try:
            signature.bind(*args, **kwargs)
        except TypeError as error:
            yield f"{way}: {error}"
            return
    names = signature.parameters
    if any(p.kind is p.VAR_KEYWORD for p in names.values()):
        for p in one.parameters:
            if p.name and p.name not in names and not re.search(rf"\b{re.escape(p.name)}\b", source):
                yield f"name {p.name!r} is not in its source"
    for p in one.parameters:
        if p.name in names and p.default is not None and names[p.name].default is not inspect.Parameter.empty:
            default = names[p.name].default
            if not same_default(p.default, default) and not (default is None and literal(p.default) is not None):
                yield f"default of {p.name!r} is {default!r}"


def source_of(function: Any) -> str:
    """The text of the folders in which a function, or a class and its bases, were written; or the ways to call it."""
    if inspect.isclass(function):
        inits = [inspect.unwrap(init) for c in function.__mro__ if inspect.isfunction(init := vars(c).get("__init__"))]
        files = {init.__code__.co_filename for init in inits}
        files |= {inspect.getfile(c) for c in function.__mro__ if c.__module__.startswith("sheldrake")}
    else:
        function = inspect.unwrap(getattr(function, "__func__", function))
        if ways := getattr(function, "_ways", None):
            return " ".join(map(str, ways))
        code = getattr(function, "__code__", None)
        files = {code.co_filename} if code else set()
    return "".join(map(text_of, {pathlib.Path(f).parent for f in files}))


@functools.cache
def text_of(folder: pathlib.Path) -> str:
    """All Python in a folder."""
    return "".join(f.read_text(encoding="utf-8") for f in sorted(folder.glob("*.py")))


def compare_calls(where: str, theirs: Any, ours: Any) -> Iterator[str]:
    """Differences of two functions."""
    signature = native_signature(ours)
    if signature is None:
        return
    for one in overloads(theirs):
        for fault in call_faults(signature, one, source_of(ours)):
            text = one.text.replace("pydrake.", "")
            yield f"{where}: {fault}  [{text[:200]}]"


def can_set(cls: type, name: str) -> bool:
    """Whether an attribute of instances of a class can be assigned."""
    member = inspect.getattr_static(cls, name, None)
    if isinstance(member, property):
        return member.fset is not None
    if (params := getattr(cls, "__dataclass_params__", None)) is not None and name in cls.__dataclass_fields__:
        return not params.frozen
    return True


def has_instance_field(cls: type, name: str) -> bool:
    """Whether instances have the attribute though the class does not."""
    if name in getattr(cls, "__dataclass_fields__", {}) or name in getattr(cls, "_fields", ()):
        return True
    if any(name in getattr(c, "__annotations__", {}) or name in getattr(c, "__slots__", ()) for c in cls.__mro__):
        return True
    if re.search(rf"\bself\.{name}\b", source_of(cls)):
        return True
    with contextlib.suppress(Exception):
        return hasattr(cls(), name)
    return False


def compare_enums(where: str, theirs: Any, ours: Any) -> Iterator[str]:
    """Differences of members, values, and of what an enum of pydrake can do."""
    members = getattr(ours, "__members__", None)
    if members is None:
        yield f"{where}: is no enum"
        return
    for name, member in theirs.__members__.items():
        if name not in members:
            yield f"{where}.{name}: missing member"
            continue
        mine = members[name]
        if (int(member), member.name) != (getattr(mine, "value", None), getattr(mine, "name", None)):
            yield f"{where}.{name}: {mine.name} = {mine.value!r}, not {member.name} = {int(member)}"
    first = next(iter(members.values()))
    for does in ("__int__", "__index__", "__hash__"):
        if not hasattr(first, does):
            yield f"{where}: no {does}"


def compare_classes(where: str, theirs: type, ours: Any) -> Iterator[str]:
    """Differences of two classes and of their members."""
    if not inspect.isclass(ours):
        yield f"{where}: is no class"
        return
    if hasattr(theirs, "__members__"):
        yield from compare_enums(where, theirs, ours)
        return
    have = {c.__name__ for c in ours.__mro__}
    lost = [c.__name__ for c in theirs.__mro__ if c.__module__.startswith("pydrake") and c.__name__ not in have]
    if lost := [name for name in lost if name.isascii() and not name.startswith("_")]:
        yield f"{where}: is no {', '.join(lost)}"
    for name in OPERATORS:
        mine = getattr(ours, name, None)
        if name in vars(theirs) and (mine is None or mine is getattr(object, name, ...)):
            yield f"{where}.{name}: missing operator"
    if vars(theirs).get("__hash__") is not None and ours.__hash__ is None:
        yield f"{where}.__hash__: missing operator"
    for name, member in vars(theirs).items():
        if name == "__init__" or (not name.startswith("_") and name.isascii()):
            yield from compare_members(f"{where}.{name}", name, theirs, member, ours)


def compare_members(where: str, name: str, theirs: type, member: Any, ours: type) -> Iterator[str]:
    """Differences of one member of two classes."""
    mine = inspect.getattr_static(ours, name, None)
    if mine is None and not hasattr(ours, name):
        if not has_instance_field(ours, name):
            yield f"{where}: missing member"
        elif isinstance(member, property) and member.fset is not None and not can_set(ours, name):
            yield f"{where}: cannot be set"
        return
    if inspect.isclass(member):
        yield from compare_classes(where, member, getattr(ours, name))
    elif isinstance(member, property):
        if callable(getattr(ours, name, None)) and inspect.isroutine(getattr(ours, name)):
            yield f"{where}: is a method, not a property"
        elif member.fset is not None and not can_set(ours, name):
            yield f"{where}: cannot be set"
    elif hasattr(member, "param_list"):
        if inspect.isfunction(mine):
            yield f"{where}: is no template"
    elif callable(getattr(theirs, name)):
        attribute = getattr(ours, name)
        if not callable(attribute):
            yield f"{where}: is no method"
            return
        is_static = isinstance(member, (staticmethod, classmethod))
        mine_static = isinstance(mine, (staticmethod, classmethod)) or inspect.isbuiltin(mine)
        if is_static and not mine_static and not hasattr(mine, "_is_static"):
            yield f"{where}: is not static"
            return
        if name == "__init__" and ours.__init__ is object.__init__:
            attribute = ours.__new__
        if not mine_static:
            attribute = without_self(attribute)
        yield from compare_calls(where, getattr(theirs, name), attribute)


def without_self(function: Any) -> Any:
    """The function as an instance has it."""
    try:
        signature = inspect.signature(function)
    except (TypeError, ValueError):
        return function
    first, *rest = signature.parameters.values() or [None]

    def bound(*args: Any, **kwargs: Any) -> None: ...

    if first is None or first.kind is first.VAR_POSITIONAL:
        return function
    bound.__signature__ = signature.replace(parameters=rest)  # type: ignore[attr-defined]
    bound.__wrapped__ = function  # type: ignore[attr-defined]
    return bound


def in_sheldrake(parameter: Any) -> Any:
    """sheldrake's class for a parameter of a template of pydrake."""
    if getattr(parameter, "__origin__", None) is list:
        return list[in_sheldrake(parameter.__args__[0])]  # type: ignore[misc]
    if not inspect.isclass(parameter) and hasattr(parameter, "name"):  # member of an enum
        return getattr(in_sheldrake(type(parameter)), parameter.name)
    module = getattr(parameter, "__module__", "") or ""
    if not module.startswith("pydrake"):
        return parameter
    name, _, of = parameter.__name__.partition("𝓣")
    scope = importlib.import_module("sheldrake" + module.removeprefix("pydrake"))
    if not of:
        return getattr(scope, name)
    argument = of.removesuffix("𝓤").rpartition("𝓹")[2]
    if name == "Image":
        return scope.Image[scope.PixelType[argument]]
    scalars = importlib.import_module("sheldrake.symbolic" if argument != "AutoDiffXd" else "sheldrake.autodiffutils")
    return getattr(scope, name.removesuffix("_") + "_")[getattr(scalars, argument)]


def compare_templates(where: str, theirs: Any, ours: Any) -> Iterator[str]:
    """Differences in what `Foo_[T]` gives."""
    if not hasattr(ours, "param_list"):
        yield f"{where}: is no template"
        return
    for param in theirs.param_list:
        names = ", ".join(getattr(p, "__name__", str(p)) for p in param)
        one = theirs[param if len(param) > 1 else param[0]]
        try:
            mapped = tuple(map(in_sheldrake, param))
            mine = ours[mapped if len(mapped) > 1 else mapped[0]]
        except Exception as error:  # Whatever it is, there is no such instantiation.
            yield f"{where}[{names}]: missing instantiation ({type(error).__name__}: {error})".splitlines()[0]
            continue
        if one.__name__ != mine.__name__ and " " not in names:
            yield f"{where}[{names}]: named {mine.__name__}, not {one.__name__}"
        if inspect.isclass(one) and names != "float":
            lost = [n for n in vars(one) if n.isascii() and not n.startswith("_") and not hasattr(mine, n)]
            yield from (f"{where}[{names}].{n}: missing member" for n in lost if not has_instance_field(mine, n))


def compare_modules(theirs: ModuleType, ours: ModuleType, seen: set[int]) -> Iterator[str]:
    """Differences of what two modules of one name have; names that only pydrake has are another table's business."""
    for name, value in sorted(vars(theirs).items()):
        if name.startswith("_") or not name.isascii() or inspect.ismodule(value) or id(value) in seen:
            continue
        if not str(getattr(value, "__module__", "") or "").startswith("pydrake") or not hasattr(ours, name):
            continue
        seen.add(id(value))
        where = f"{ours.__name__.removeprefix('sheldrake.')}.{name}"
        mine = getattr(ours, name)
        if hasattr(value, "param_list"):
            yield from compare_templates(where, value, mine)
        elif inspect.isclass(value):
            yield from compare_classes(where, value, mine)
        elif callable(value):
            yield from compare_calls(where, value, mine) if callable(mine) else [f"{where}: is not callable"]


def module_names() -> list[str]:
    """All public modules of pydrake but its collections of others."""
    import pydrake
    import pydrake.all  # It makes the modules that are inside shared libraries known.

    skipped = ("pydrake.all", "pydrake.gym", "pydrake.tutorials")
    names = {m.name for m in pkgutil.walk_packages(pydrake.__path__, "pydrake.")} | {
        n for n in sys.modules if n.startswith("pydrake.")
    }
    names = {n for n in names if not any(p.startswith("_") or p in ("test", "all") for p in n.split(".")[1:])}
    return sorted(n for n in names if not n.startswith(skipped))


def differences(prefix: str = "sheldrake") -> Iterator[str]:
    """All differences of modules whose sheldrake name begins with a prefix."""
    seen: set[int] = set()
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        for name in module_names():
            native = "sheldrake" + name.removeprefix("pydrake")
            try:
                theirs, ours = importlib.import_module(name), importlib.import_module(native)
            except ImportError:
                continue
            found = list(compare_modules(theirs, ours, seen))
            if native.startswith(prefix):
                yield from found


def stub_texts(path: pathlib.Path) -> dict[str, str]:
    """The `.pyi` files of a wheel or folder by the names of their modules."""
    if path.is_dir():
        found = {str(f.relative_to(path)): f.read_text(encoding="utf-8") for f in path.rglob("*.pyi")}
    else:
        with zipfile.ZipFile(path) as wheel:
            found = {n: wheel.read(n).decode() for n in wheel.namelist() if n.endswith(".pyi")}
    found = {f.removesuffix(".pyi").removesuffix("/__init__").replace("/", "."): t for f, t in found.items()}
    # Python folds the letter that names instantiations into a T; another one keeps them apart.
    names = [n for n in sorted(found) if n.startswith("pydrake.") and not n.endswith(".all")]
    found = {n: found[n].replace("𝓣", "ǂ") for n in names}
    if not found:
        raise SystemExit(f"{path} has no stubs of pydrake: expected a wheel, or the folder that has pydrake/*.pyi")
    return found


def stub_overload(node: ast.FunctionDef) -> Overload:
    """What a `def` of a stub says about calling it, without `self`."""
    spec = node.args
    by_position = [*spec.posonlyargs, *spec.args]
    defaults = [None] * (len(by_position) - len(spec.defaults)) + [ast.unparse(d) for d in spec.defaults]
    parameters = [
        Parameter("" if a in spec.posonlyargs else a.arg, default, False)
        for a, default in zip(by_position, defaults, strict=True)
        if a.arg != "self"
    ]
    parameters += [
        Parameter(a.arg, ast.unparse(d) if d else None, True)
        for a, d in zip(spec.kwonlyargs, spec.kw_defaults, strict=True)
    ]
    text = f"{node.name}({ast.unparse(spec)})"
    return Overload(text, parameters, spec.vararg is not None or spec.kwarg is not None)


def has_decorator(node: ast.FunctionDef, name: str) -> bool:
    """Whether a `def` has a decorator `name` or `<something>.name`."""
    return any(name in (getattr(d, "id", ""), getattr(d, "attr", "")) for d in node.decorator_list)


def stub_scope(body: list[ast.stmt], where: str, ours: Any) -> Iterator[str]:
    """Differences of what the body of a stub, or of a class in it, declares."""
    functions: dict[str, list[ast.FunctionDef]] = {}
    names: list[str] = []
    for node in body:
        if isinstance(node, ast.ClassDef):
            if node.name.isascii() and (mine := getattr(ours, node.name, None)) is not None:
                yield from stub_scope(node.body, f"{where}.{node.name}", mine)
            names.append(node.name)
        elif isinstance(node, ast.FunctionDef):
            functions.setdefault(node.name, []).append(node)
        elif isinstance(node, ast.Assign | ast.AnnAssign):
            targets = node.targets if isinstance(node, ast.Assign) else [node.target]
            names += [t.id for t in targets if isinstance(t, ast.Name)]
    for name in (*names, *functions):
        if not name.isascii() or (name.startswith("_") and name != "__init__"):
            continue
        one = f"{where}.{name}"
        if not hasattr(ours, name) and not (inspect.isclass(ours) and has_instance_field(ours, name)):
            yield f"{one}: missing"
        elif name in functions and hasattr(ours, name):
            yield from stub_function(functions[name], one, name, ours)


def stub_function(nodes: list[ast.FunctionDef], where: str, name: str, ours: Any) -> Iterator[str]:
    """Differences of a function, method or property that both sides have."""
    mine = inspect.getattr_static(ours, name, None)
    if has_decorator(nodes[0], "property"):
        if any(has_decorator(n, "setter") for n in nodes) and inspect.isclass(ours) and not can_set(ours, name):
            yield f"{where}: cannot be set"
        return
    attribute = getattr(ours, name)
    if not callable(attribute):
        yield f"{where}: is not callable"
        return
    if name == "__init__" and attribute is object.__init__:
        attribute = ours.__new__
    if inspect.isclass(ours) and not (isinstance(mine, staticmethod | classmethod) or inspect.isbuiltin(mine)):
        attribute = without_self(attribute)
    if (signature := native_signature(attribute)) is not None:
        for one in map(stub_overload, nodes):
            for fault in call_faults(signature, one, source_of(attribute)):
                yield f"{where}: {fault}  [{one.text.replace('pydrake.', '')[:200]}]"


def stub_differences(path: pathlib.Path, prefix: str = "sheldrake") -> Iterator[str]:
    """All differences from the stubs of a wheel or folder, of modules whose sheldrake name begins with a prefix."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        for name, text in stub_texts(path).items():
            native = "sheldrake" + name.removeprefix("pydrake")
            if not native.startswith(prefix):
                continue
            where = native.removeprefix("sheldrake.")
            try:
                ours = importlib.import_module(native)
            except ModuleNotFoundError:
                yield f"{where}: missing module"
                continue
            yield from stub_scope(ast.parse(text).body, where, ours)


ONLY_IN_STUBS = "# Only in the stubs of "


def known(stubs: bool = True) -> dict[str, str]:
    """Reasons by patterns of what they excuse: `multibody.plant.Foo.*: not planned = reason`."""
    out = {}
    text = KNOWN.read_text(encoding="utf-8") if KNOWN.exists() else ""
    for line in (text if stubs else text.partition(ONLY_IN_STUBS)[0]).splitlines():
        if line and not line.startswith("#"):
            pattern, _, reason = line.partition(" = ")
            out[pattern.strip()] = reason.strip()
    return out


def unexplained(found: Iterable[str]) -> list[str]:
    """The differences that no pattern of `known()` fits."""
    patterns = list(known())
    return [d for d in found if not any(fnmatch.fnmatchcase(d.partition("  [")[0], p) for p in patterns)]


def main() -> int:
    """Prints the differences without a reason."""
    parser = argparse.ArgumentParser(description="differences of sheldrake's public surface from pydrake's")
    parser.add_argument("prefix", nargs="?", default="sheldrake", help="names of modules of sheldrake begin with it")
    parser.add_argument("--stubs", type=pathlib.Path, help="wheel or folder whose .pyi files are compared")
    args = parser.parse_args()
    found = unexplained(stub_differences(args.stubs, args.prefix) if args.stubs else differences(args.prefix))
    print("\n".join(found))
    print(f"{len(found)} differences", file=sys.stderr)
    return bool(found)


if __name__ == "__main__":
    sys.exit(main())
