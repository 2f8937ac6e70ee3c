"""Every public call of classes that need no plant (values, sets, trajectories, programs, blocks ...), against Drake.

    python benchmarks/every_class.py [CLASS ...] [--rounds 3] [--only REGEX] [--functions] [--differences]

`_objects.py` has an expression for an object of each class; constructors, static methods, methods, properties and
operators are those of Drake's class, their arguments made from the signatures that Drake's docstrings state. Where a
signature leaves sizes open, those are taken that Drake accepts. Each call gets an object of its own in both libraries;
its answer is compared in depth, by all getters without arguments, and so is the object after the call. `--functions`
sweeps the functions of modules. A class that ends Drake's process is reported as such: each has a process of its own.
"""

from __future__ import annotations

import argparse
import functools
import importlib
import inspect
import itertools
import json
import os
import pathlib
import re
import sys
import tempfile
import types
import warnings
from collections.abc import Callable, Iterator
from typing import Any, NamedTuple

import numpy as np

ROOT = pathlib.Path(__file__).resolve().parents[1]
sys.path[:0] = [str(ROOT), str(ROOT / "src")]

from benchmarks._objects import OBJECTS  # noqa: E402
from benchmarks.every_call import Loss, measured  # noqa: E402
from benchmarks.turns import machine, repeated_time  # noqa: E402

MODULES = (
    "all autodiffutils common common.eigen_geometry common.schema common.value examples geometry geometry.optimization "
    "manipulation math multibody.inverse_kinematics multibody.math multibody.optimization multibody.parsing "
    "multibody.plant multibody.rational multibody.tree perception planning solvers symbolic systems.analysis "
    "systems.controllers systems.estimators systems.framework systems.lcm systems.perception systems.primitives "
    "systems.sensors trajectories visualization"
).split()
LEFT_ALONE = re.compile(
    r"Graphviz|Write|Animat|Start|ToLatex$|Dump|Publish$|get_(leaf|monitor)|Stop|AddReal|^_(?!_)|𝓤$|"
    r"^__(?!(init|add|sub|mul|matmul|truediv|neg|pow|getitem|len|eq|ne|lt|le|gt|ge|call|r(add|sub|mul|truediv)|str|"
    r"contains)__)\w+__$|ticket|get_id$|recursion|^Declare|"
    r"GetSystemType|Mutable|_mutable|cache_entry|Accept$|^Do[A-Z]|num_numeric|num_abstract|GetMemoryObjectName|"
    r"get_system_id|FullDescription|Download|AddPackage|PopulateFrom|AddRemote|all_?digits|SetAbstractState"
)
"""Names of what opens files and pages, or of what each library has inside."""
INSIDE = re.compile(
    r"hash|solve_time|FeasiblePoint|get_id$|^id$|ticket|Mutable|_mutable|system_scalar|cache|leaf|to_latex|full_?description|Graphviz|"
    r"get_solver_details|get_value$|GetMutable|memory|address|^owner|get_parent|Clone|__|get_system$|Alloc|Default|"
    r"^name$|get_name$|GetSystem|FullDescr|^type_info|geometry_version|Expand|ToExpression|pathname|Reset|Release|Clear|"
    r"^Set|^set|^Remove|^Add|Fix|release|clear|^Evaluate$|^sample|Scale|Initialize|inverse|square|conjugate|norm|"
    r"^Num(eric|Abs)|𝓤$|is_thread_safe|^To(Auto|Symb)|Principal|AdvancePend|^GetInputPort|^GetOutputPort|^GetGraph|ChebyshevCenter|Maximum|Sample|Draw|GetDiagram|zero|Zero|Finalize|Pop|Step|reverse|EndSub"
)
"""Getters that are not asked of an answer."""


class Call(NamedTuple):
    """One form of something that can be called: where it is found, its name, names and types of its arguments."""

    owner: str
    name: str
    kind: str
    parameters: tuple[tuple[str, str, bool], ...]

    def title(self) -> str:
        arguments = ", ".join(f"{name}: {shown(kind)}" for name, kind, _ in self.parameters)
        return f"{self.owner}.{self.name}({arguments})"


def shown(kind: str) -> str:
    return re.sub(r"pydrake\.[\w.]*\.|numpy\.ndarray|numpy\.|typing\.", "", re.sub("_𝓣float𝓤", "", kind))


class Library:
    """The names of one library, and what objects are made of."""

    def __init__(self, name: str) -> None:
        self.name = name
        self.names: dict[str, Any] = {"np": np}
        self.modules = {}
        for module in reversed(MODULES):
            found = self.modules[module] = importlib.import_module(f"{name}.{module}")
            self.names.update({key: value for key, value in vars(found).items() if not key.startswith("__")})
        self.names.update(vars(self.modules["all"]))
        symbolic = importlib.import_module(f"{name}.symbolic")
        self.names.update({key: getattr(symbolic, key) for key in symbolic.__dict__ if not key.startswith("_")})
        self.names["sin"] = symbolic.sin
        polynomial = importlib.import_module(f"{name}.polynomial")
        self.names.update(_Polynomial=polynomial.Polynomial, Polynomial_=polynomial.Polynomial_)
        self.names.update(helpers(self.names))

    def make(self, expression: str) -> Any:
        return eval(expression, self.names)

    def get(self, name: str) -> Any:
        return self.names[name]


def helpers(names: dict[str, Any]) -> dict[str, Any]:
    """What several expressions need."""
    import scipy.sparse

    variables = np.array([names["Variable"](name) for name in "xyz"])
    corners = np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]])
    cube = np.array(list(itertools.product((0.0, 1.0), repeat=3))).T

    def properties(kind: Any) -> Any:
        made = kind()
        made.AddProperty("group", "number", 1.5)
        made.AddProperty("group", "word", "abc")
        return made

    def program() -> Any:
        prog = names["MathematicalProgram"]()
        x = prog.NewContinuousVariables(3, "x")
        prog.AddLinearConstraint(x[0] + 2 * x[1] >= 1)
        prog.AddBoundingBoxConstraint(-1.0, 2.0, x)
        prog.AddQuadraticCost(np.diag([1.0, 2.0, 3.0]), [0.1, 0.2, 0.3], x)
        prog.AddLinearEqualityConstraint(x[1] + x[2] == 0.5)
        prog.SetInitialGuess(x, [0.1, 0.2, 0.3])
        return prog

    def stacked(kind: Any) -> Any:
        made = kind()
        made.Append(names["BezierCurve"](0.0, 2.0, POINTS))
        made.Append(names["PiecewisePolynomial"].FirstOrderHold([0.0, 2.0], [[0.0, 1.0]]))
        return made

    def spectrahedron() -> Any:
        prog = names["MathematicalProgram"]()
        matrix = prog.NewSymmetricContinuousVariables(2, "X")
        prog.AddPositiveSemidefiniteConstraint(matrix)
        prog.AddBoundingBoxConstraint(-1.0, 1.0, matrix[np.triu_indices(2)])
        return names["Spectrahedron"](prog)

    def scalars(kind: str, numbers: Any) -> Any:
        """Those numbers as a scalar, with derivatives, or as multiples of variables."""
        values = np.array(numbers)
        found = [x / y for x, y in zip(values.ravel(), itertools.cycle(NUMBERS))]
        return np.array([x * y for x, y in zip(found, itertools.cycle(made[f"_s_{kind}"]))], object).reshape(
            values.shape
        )

    def periodic(kind: Any) -> Any:
        return kind()

    def advanced(kind: Any) -> Any:
        return kind(names["ConstantVectorSource"]([1.0])).AdvanceTo(0.1)

    def bus(kind: Any) -> Any:
        made = kind()
        made.Set("a", names["AbstractValue"].Make(1.5))
        return made

    def wrap(kind: Any) -> Any:
        made = kind(2)
        made.set_interval(0, -1.0, 1.0)
        return made

    def cloud(kind: Any, fields: Any) -> Any:
        made = kind(4, fields)
        made.mutable_xyzs()[:] = corners.T
        made.mutable_normals()[:] = np.array([[0.0], [0.0], [1.0]])
        return made

    def zmp(kind: Any, piecewise: Any) -> Any:
        made = kind()
        made.Plan(piecewise.FirstOrderHold([0.0, 1.0, 2.0], POINTS[:, :3]), [0.0, 0.0, 0.0, 0.0], 1.0)
        return made

    made = {
        "_variables": variables, "_scalars": scalars,
        "_corners": corners, "_cube": cube, "_points": POINTS, "_obj": OBJ,
        "_properties": properties, "_program": program, "_stacked": stacked, "_spectrahedron": spectrahedron,
        "_periodic": periodic, "_advanced": advanced, "_bus": bus, "_wrap": wrap, "_cloud": cloud, "_zmp": zmp,
        "_sparse": scipy.sparse.csc_matrix,
        "_s_AutoDiffXd": np.array([names["AutoDiffXd"](v, w) for v, w in zip(NUMBERS, GRADIENTS)]),
        "_s_Expression": np.array([names["Variable"](f"s{k}") * 1.0 for k in range(7)]),
        "_A": np.array([[-0.1, 1.0], [-1.0, -0.2]]), "_B": np.array([[0.0], [1.0]]), "_f": np.array([0.1, 0.2]),
        "_C": np.array([[1.0, 0.5]]), "_D": np.array([[0.1]]), "_y": np.array([0.3]),
    }  # fmt: skip
    return made


NUMBERS = 0.3, 0.2, 0.5, 0.7, 0.4, 0.6, 0.1
GRADIENTS = np.round(np.cos(np.arange(21.0).reshape(7, 3) * 1.3), 3)
POINTS = np.array([[0.0, 0.5, 1.0, 0.8, 0.2, 0.1], [1.0, 0.7, 0.2, 0.4, 0.9, 0.3]])
OBJ = "\n".join(
    [f"v {x} {y} {z}" for x in (0, 1) for y in (0, 1) for z in (0, 1)]
    + [f"f {face}" for face in "1 2 4,1 4 3,5 7 8,5 8 6,1 5 6,1 6 2,3 4 8,3 8 7,1 3 7,1 7 5,2 6 8,2 8 4".split(",")]
).encode()


def arrays(shape: str, kind: str) -> list[Any]:
    """Arrays of a shape as docstrings state it, of the sizes that are tried; m and n are open."""
    sizes = [part.strip() for part in shape.split(",")]
    open_sizes = {"m": (3, 2, 1, 4, 6, 7), "n": (3, 2, 1, 4, 5)}
    found = []
    for m, n in itertools.product(open_sizes["m"] if "m" in sizes else (0,), open_sizes["n"] if "n" in sizes else (0,)):
        size = [m if part == "m" else n if part == "n" else int(part) for part in sizes]
        count = int(np.prod(size))
        values = np.round(0.3 + 0.25 * np.cos(np.arange(count) * 1.3), 3)
        made = values.reshape(size)
        if len(size) == 2 and size[1] == 1:
            made = made[:, 0]
        if "int" in kind:
            made = np.arange(count).reshape(made.shape)
        found.append(made)
        if size == [3, 3]:
            found.insert(0, np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]]))
        if len(size) == 2 and size[0] == size[1] and size[0] > 1:
            found.append(made @ made.T + np.eye(size[0]))
    return found


class Arguments:
    """Values for the types that signatures state, each as a function that makes it for a library."""

    def __init__(self, drake: Library) -> None:
        self.drake = drake
        self.scalar = ""  # of the class whose calls are made; nothing for classes that have one only

    def candidates(self, name: str, kind: str) -> list[Callable[[Library, Any], Any]]:
        """What can be given, the likeliest first."""
        plain = re.sub(r"_𝓣float𝓤", "", kind)
        short = plain.split(".")[-1]
        template = re.fullmatch(r"(\w+_)𝓣(\w+)𝓤", short)
        if template:
            expression = OBJECTS.get(f"{template[1]}[{template[2]}]", "None")
            return [always(expression)] if expression != "None" else []
        array = re.fullmatch(r"numpy\.ndarray\[(?:numpy\.)?(\w+)\[([\w, ]+)\](?:, flags\.\w+)*\]", plain)
        if array:
            return self.of_array(array[1], array[2])
        if plain.startswith("scipy.sparse"):
            return [always(f"_sparse(np.array({m.tolist()}))") for m in arrays("m, n", "float")]
        choice = re.fullmatch(r"(?:typing\.)?(?:Optional|Union)\[(.*)\]", plain)
        if choice:
            return [c for part in split(choice[1]) for c in self.candidates(name, part)]
        if plain.lower().startswith(("list[", "typing.list[", "typing.sequence[", "sequence[", "std::vector<")):
            inner = plain[plain.index("[") + 1 : -1]
            return [lists(c, n) for n in (2, 3, 1) for c in self.candidates(name, inner)[:4]]
        simple = {
            "float": ["0.3", "1.0", "2.0"], "int": ["1", "0", "2", "3"], "bool": ["True"], "str": ["'x'", "'group'"],
            "typing.SupportsFloat": ["0.3", "1.0", "2.0"], "typing.SupportsInt": ["1", "0", "2", "3"],
            "bytes": ["b'x'"], "numpy.float64": ["0.3"], "object": ["1.5"], "handle": ["1.5"],
        }  # fmt: skip
        if plain in simple:
            return [always(text) for text in simple[plain]]
        if self.scalar and short == self.scalar:
            return [always(f"_s_{short}[{k}]") for k in (2, 0)]
        if short == "Context":
            return [context]
        if plain == "pydrake.polynomial.Polynomial":
            return [always(OBJECTS["polynomial.Polynomial"])]
        if short in ("ConvexSet",):
            return [always(OBJECTS[each]) for each in ("HPolyhedron", "Point")]
        if short == "Trajectory":
            return [always(OBJECTS[each]) for each in ("BezierCurve", "PiecewisePolynomial")]
        if short == "Shape":
            return [always(OBJECTS["Sphere"])]
        if short == "System":
            return [always("Integrator(2)")]
        if OBJECTS.get(short, "None") != "None":
            return [always(OBJECTS[short])]
        if short.endswith("Index") and short in self.drake.names:
            return [always(f"{short}({k})") for k in (0, 1)]
        found = self.drake.names.get(short)
        if inspect.isclass(found) and getattr(found, "__members__", None):
            return [always(f"{short}.{member}") for member in list(found.__members__)[:2]]
        return []

    def of_array(self, kind: str, shape: str) -> list[Callable[[Library, Any], Any]]:
        if kind == "object":
            made = arrays(shape, "float")
            if self.scalar:
                return [always(f"_scalars('{self.scalar}', {m.tolist()})") for m in arrays(shape, "float")]
            names = "_variables", "np.array([Expression(v) for v in _variables])"
            found = [always(names[0]), always(names[1]), always(f"{names[0]}[:2]"), always(f"{names[0]}[:1]")]
            return found + [always(f"np.array({m.tolist()})") for m in made]
        text = (
            "dtype=bool"
            if kind == "bool"
            else "dtype=np.int64"
            if "int64" in kind
            else "dtype=np.int32"
            if "int" in kind
            else "dtype=float"
        )
        return [always(f"np.array({m.tolist()}, {text})") for m in arrays(shape, kind)]


def always(expression: str) -> Callable[[Library, Any], Any]:
    def given(library: Library, subject: Any) -> Any:
        return library.make(expression)

    return given


def lists(made: Callable[[Library, Any], Any], count: int) -> Callable[[Library, Any], Any]:
    def given(library: Library, subject: Any) -> Any:
        return [made(library, subject) for _ in range(count)]

    return given


def context(library: Library, subject: Any) -> Any:
    """A context of the subject, its inputs fixed."""
    made = subject.CreateDefaultContext()
    for index in range(subject.num_input_ports()):
        port = subject.get_input_port(index)
        if port.get_data_type() == library.get("PortDataType").kVectorValued and port.size():
            port.FixValue(made, np.linspace(0.1, 0.3, port.size()))
    return made


def split(text: str) -> list[str]:
    """The parts between commas that are in no brackets."""
    parts, depth, start = [], 0, 0
    for k, letter in enumerate(text):
        depth += letter in "[(<{"
        depth -= letter in "])>}"
        if letter == "," and depth == 0:
            parts.append(text[start:k].strip())
            start = k + 1
    return [part for part in [*parts, text[start:].strip()] if part]


def calls_of(owner: str, name: str, text: str, subject: bool) -> Iterator[Call]:
    """The forms that a docstring states."""
    for form in re.finditer(rf"^(?:\d+\. )?{re.escape(name)}\((.*)\) -> ", text, re.MULTILINE):
        parts = [part.partition(": ") for part in split(form[1])]
        parts = [(left, *right.partition(" = ")[::2]) for left, _, right in parts]
        bound = bool(parts) and parts[0][0] == "self"
        if any(left.startswith("*") or not right for left, right, _ in parts[bound:]):
            continue
        kind = "new" if name == "__init__" else "method" if bound else "static" if subject else "function"
        rest = tuple((left, right, bool(default)) for left, right, default in parts[bound:])
        required = tuple(part for part in rest if not part[2])
        yield Call(owner, name, kind, required)
        if required != rest:
            yield Call(owner, name, kind, rest)


def calls_of_class(owner: str, kind: type) -> Iterator[Call]:
    """Everything of a class."""
    for name in dir(kind):
        if LEFT_ALONE.search(name):
            continue
        found = inspect.getattr_static(kind, name)
        if isinstance(found, property):
            yield Call(owner, name, "property", ())
            continue
        text = getattr(kind, name).__doc__ or ""
        yield from dict.fromkeys(calls_of(owner, name, text, True))


def unequal(ours: Any, drakes: Any, depth: int = 3, path: str = "") -> str:
    """Where two answers differ; nothing where they do not."""
    if drakes is None or ours is None:
        return "" if ours is drakes else f"{path}: {brief(ours)} for {brief(drakes)}"
    if isinstance(drakes, (bool, np.bool_, str, bytes)) or isinstance(ours, (bool, np.bool_, str, bytes)):
        equal = (
            isinstance(ours, (bool, np.bool_, str, bytes)) and type_name(ours) == type_name(drakes) and ours == drakes
        )
        return "" if equal else f"{path}: {brief(ours)} for {brief(drakes)}"
    if isinstance(drakes, (int, float, np.integer, np.floating)):
        if not isinstance(ours, (int, float, np.integer, np.floating)):
            return f"{path}: {type(ours).__name__} {brief(ours)} for {brief(drakes)}"
        equal = near(ours, drakes) and isinstance(ours, (int, np.integer)) == isinstance(drakes, (int, np.integer))
        return "" if equal else f"{path}: {brief(ours)} for {brief(drakes)}"
    if hasattr(drakes, "toarray"):
        if not hasattr(ours, "toarray"):
            return f"{path}: {type(ours).__name__} for {type(drakes).__name__}"
        return unequal(ours.toarray(), drakes.toarray(), depth, path)
    if isinstance(drakes, np.ndarray):
        return unequal_arrays(ours, drakes, depth, path)
    if isinstance(drakes, (list, tuple)):
        if not isinstance(ours, (list, tuple)) or isinstance(ours, list) != isinstance(drakes, list):
            return f"{path}: {type(ours).__name__} for {type(drakes).__name__}"
        if len(ours) != len(drakes):
            return f"{path}: {len(ours)} for {len(drakes)} elements"
        return next(
            filter(None, (unequal(a, b, depth, f"{path}[{k}]") for k, (a, b) in enumerate(zip(ours, drakes)))), ""
        )
    if isinstance(drakes, dict):
        if not isinstance(ours, dict) or len(ours) != len(drakes):
            return f"{path}: {brief(ours)} for {brief(drakes)}"
        return unequal(*(sorted(d.values(), key=str) for d in (ours, drakes)), depth, path)
    if isinstance(drakes, (set, frozenset)):
        return (
            "" if sorted(map(str, ours)) == sorted(map(str, drakes)) else f"{path}: {brief(ours)} for {brief(drakes)}"
        )
    return unequal_objects(ours, drakes, depth, path)


def unequal_arrays(ours: Any, drakes: Any, depth: int, path: str) -> str:
    if not isinstance(ours, np.ndarray) or ours.shape != drakes.shape:
        return f"{path}: {type(ours).__name__} {getattr(ours, 'shape', '')} for {drakes.shape}"
    if (ours.dtype == object) != (drakes.dtype == object) or ours.dtype.kind != drakes.dtype.kind:
        return f"{path}: dtype {ours.dtype} for {drakes.dtype}"
    if drakes.dtype == object:
        return unequal(list(ours.ravel()), list(drakes.ravel()), depth, path)
    largest = float(np.max(np.abs(drakes[np.isfinite(drakes)]), initial=1e-4)) if drakes.dtype.kind in "fiu" else 1.0
    equal = np.allclose(ours, drakes, rtol=0.0, atol=2e-6 * largest, equal_nan=True)
    return "" if equal else f"{path}: {brief(ours)} for {brief(drakes)}"


def near(a: Any, b: Any) -> bool:
    return bool(a == b or (a != a and b != b) or abs(a - b) <= 2e-6 * max(abs(b), 1e-4))


def type_name(value: Any) -> str:
    return re.sub(r"_𝓣.*𝓤|_\[.*\]|_$", "", type(value).__name__).lstrip("_")


WORDS = "Variable Variables Expression Formula Monomial Polynomial RationalFunction SourceId".split()
"""Classes that are compared as they are written."""


def unequal_objects(ours: Any, drakes: Any, depth: int, path: str) -> str:
    name = type_name(drakes)
    if name == "AutoDiffXd" and type_name(ours) == name:
        found = unequal(ours.value(), drakes.value(), depth, path)
        return found or unequal(ours.derivatives(), drakes.derivatives(), depth, f"{path}.derivatives")
    if name in ("Expression", "Formula") and type_name(ours) == name and str(ours) != str(drakes):
        return unequal_values(ours, drakes, path)
    if type_name(ours) != name:
        return f"{path}: a {type_name(ours)} for a {name}"
    if depth == 0 or (name.endswith(("Id", "Ticket")) and name != "SolverId"):
        return ""
    if inspect.isroutine(drakes) or isinstance(drakes, types.ModuleType):
        return ""
    if getattr(type(drakes), "__members__", None):
        return "" if ours.name == drakes.name else f"{path}: {ours.name} for {drakes.name}"
    if name == "Polynomial" and hasattr(drakes, "GetCoefficients"):
        return unequal(ours.GetCoefficients(), drakes.GetCoefficients(), depth, path)
    if name in WORDS:
        return "" if str(ours) == str(drakes) else f"{path}: {ours} for {drakes}"
    for getter in getters(type(drakes)):
        if isinstance(inspect.getattr_static(type(drakes), getter), property):
            theirs, refused = outcome(functools.partial(getattr, drakes, getter))
            mine, error = outcome(functools.partial(getattr, ours, getter))
        else:
            theirs, refused = outcome(getattr(drakes, getter))
            mine, error = outcome(getattr(ours, getter, lacking))
        if refused is not None:
            continue
        if error is not None:
            return f"{path}.{getter}: {type(error).__name__} {str(error)[:80]}"
        found = unequal(mine, theirs, depth - 1, f"{path}.{getter}")
        if found:
            return found
    return ""


def unequal_values(ours: Any, drakes: Any, path: str) -> str:
    """Where two expressions differ that are written differently: at numbers that their variables' names give."""
    values = []
    for expression in (ours, drakes):
        formula = type_name(expression) == "Formula"
        names = sorted(expression.GetFreeVariables() if formula else expression.GetVariables(), key=str)
        values.append(expression.Evaluate({v: 0.3 + 0.1 * (sum(str(v).encode()) % 7) for v in names}))
    return "" if near(*values) else f"{path}: {brief(ours)} for {brief(drakes)}"


def outcome(call: Callable[[], Any]) -> tuple[Any, BaseException | None]:
    """What a call answers, or what it raises; Drake's assertions are `SystemExit`."""
    try:
        return call(), None
    except (Exception, SystemExit) as error:
        return None, error


def lacking(*given: Any) -> None:
    raise AttributeError("no such method")


@functools.cache
def getters(kind: type) -> list[str]:
    """Names of what can be asked of an object without arguments, in Drake."""
    found = []
    for name in dir(kind):
        if name.startswith("_") or INSIDE.search(name):
            continue
        member = inspect.getattr_static(kind, name)
        if isinstance(member, property):
            found.append(name)
        elif re.match(rf"{name}\(self: [^,)]+\) -> (?!None)", getattr(kind, name).__doc__ or ""):
            found.append(name)
    return found


def brief(value: Any) -> str:
    return re.sub(r"\s+", " ", str(value))[:70]


class Sweep:
    """Both libraries."""

    def __init__(self) -> None:
        self.libraries = {name: Library(name) for name in ("pydrake", "sheldrake")}
        self.arguments = Arguments(self.libraries["pydrake"])
        self.differences: list[str] = []
        self.left_out: list[str] = []
        self.fatal: list[str] = []
        self.at = ""
        self.alike = True

    def of_class(self, name: str, only: str) -> Iterator[tuple[str, dict[str, Callable[[], Any]]]]:
        subjects = [library.make(OBJECTS[name]) for library in self.libraries.values()]
        kind = type(subjects[0])
        scalar = re.search(r"_\[(\w+)\]$", name)
        self.arguments.scalar = scalar[1] if scalar else ""
        self.alike = not unequal(subjects[1], subjects[0])
        if not self.alike:
            self.differences.append(f"{name}: {unequal(subjects[1], subjects[0])}")
        for call in calls_of_class(name, kind):
            if re.search(only, call.title()):
                yield from self.tried(call, OBJECTS[name])

    def of_functions(self, module: str, only: str) -> Iterator[tuple[str, dict[str, Callable[[], Any]]]]:
        for name, found in sorted(vars(self.libraries["pydrake"].modules[module]).items()):
            text = getattr(found, "__doc__", None) or ""
            if name.startswith("_") or inspect.isclass(found) or not callable(found) or LEFT_ALONE.search(name):
                continue
            for call in dict.fromkeys(calls_of(module, name, text, False)):
                if re.search(only, call.title()):
                    yield from self.tried(call, "None")

    def tried(self, call: Call, expression: str) -> Iterator[tuple[str, dict[str, Callable[[], Any]]]]:
        """The call with the first arguments that Drake takes."""
        if call.title() in self.fatal:
            return
        pathlib.Path(self.at).write_text(call.title())
        options = [self.arguments.candidates(name, kind) for name, kind, _ in call.parameters]
        if not all(options):
            kind = next(kind for (_, kind, _), found in zip(call.parameters, options) if not found)
            self.left_out.append(f"{call.title()}: {kind[:80]}")
            return
        refused = None
        for choice in itertools.islice(itertools.product(*options), 60):
            try:
                drakes, subject = self.bound(self.libraries["pydrake"], call, expression, choice)
            except (Exception, SystemExit) as error:
                refused = error
                continue
            answer, refused = outcome(drakes)
            if refused is None:
                break
        else:
            self.left_out.append(f"{call.title()}: {brief(refused)}")
            return
        try:
            ours, own = self.bound(self.libraries["sheldrake"], call, expression, choice)
        except Exception as error:
            self.differences.append(f"{call.title()}: {type(error).__name__}: {brief(error)}")
            return
        mine, error = outcome(ours)
        if error is not None:
            self.differences.append(f"{call.title()}: {type(error).__name__}: {str(error)[:150]}")
            return
        found = unequal(mine, answer) or (
            unequal(own, subject, path="afterwards") if subject is not None and self.alike else ""
        )
        if found:
            self.differences.append(f"{call.title()}: {found}")
        fresh = {name: self.bound(self.libraries[name], call, expression, choice)[0] for name in self.libraries}
        yield call.title(), fresh

    def bound(self, library: Library, call: Call, expression: str, choice: Any) -> tuple[Callable[[], Any], Any]:
        """The call with its arguments, and what it is asked of."""
        subject = library.make(expression)
        given = [make(library, subject) for make in choice]
        if call.kind == "function":
            return functools.partial(getattr(library.modules[call.owner], call.name, lacking), *given), None
        if call.kind == "new":
            return functools.partial(type(subject), *given), None
        if call.kind == "static":
            return functools.partial(getattr(type(subject), call.name, lacking), *given), None
        if call.kind == "property":
            return functools.partial(getattr, subject, call.name), subject
        return functools.partial(getattr(subject, call.name, lacking), *given), subject


def apart(job: Callable[[], dict[str, Any]], seconds: int = 300) -> dict[str, Any]:
    """What a job reports from a process of its own."""
    import signal

    read, write = os.pipe()
    child = os.fork()
    if child == 0:
        os.close(read)
        signal.alarm(seconds)
        null = os.open(os.devnull, os.O_WRONLY)
        os.dup2(null, 2)
        os.dup2(null, 1)
        try:
            report = json.dumps(job())
        except BaseException as error:
            report = json.dumps({"fault": f"{type(error).__name__}: {error}"})
        with os.fdopen(write, "w") as pipe:
            pipe.write(report)
        os._exit(0)
    os.close(write)
    with os.fdopen(read) as pipe:
        text = pipe.read()
    _, status = os.waitpid(child, 0)
    return json.loads(text) if text else {"ended": status}


def warmed_up(call: Callable[[], Any]) -> None:
    """Calls it as often as it takes until what is made for who asks again and again is there."""
    call()
    if repeated_time(call, 1) < 1e4:
        repeated_time(call, 5)


def swept(sweep: Sweep, name: str, options: argparse.Namespace) -> dict[str, Any]:
    """All calls of a class, or functions of a module."""
    losses = []
    calls = sweep.of_functions(name, options.only) if options.functions else sweep.of_class(name, options.only)
    for title, pair in calls:
        if not options.differences:
            for call in pair.values():
                outcome(functools.partial(warmed_up, call))
            loss, error = outcome(functools.partial(measured, title, pair, options.rounds))
            if error is None:
                losses.append(list(loss))
    return {"losses": losses, "differences": sweep.differences, "left_out": sweep.left_out}


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("classes", nargs="*")
    parser.add_argument("--rounds", type=int, default=3)
    parser.add_argument("--only", default="")
    parser.add_argument("--functions", action="store_true", help="functions of modules")
    parser.add_argument("--differences", action="store_true")
    parser.add_argument("--left-out", action="store_true")
    parser.add_argument("--slower", action="store_true")
    options = parser.parse_args()
    importlib.import_module("pydrake.all")  # which sets filters of its own
    warnings.simplefilter("ignore")
    sweep = Sweep()
    names = MODULES[1:] if options.functions else [name for name, text in OBJECTS.items() if text != "None"]
    losses: list[Loss] = []
    sweep.at = tempfile.mkstemp()[1]
    for name in options.classes or names:
        report = apart(functools.partial(swept, sweep, name, options))
        while "ended" in report and len(sweep.fatal) < 100:
            sweep.fatal.append(pathlib.Path(sweep.at).read_text())
            print(f"process ended with {report['ended']}:", sweep.fatal[-1], flush=True)
            report = apart(functools.partial(swept, sweep, name, options))
        if "fault" in report:
            print(f"{name}: {report['fault']}", flush=True)
            continue
        for line in report["differences"]:
            print("differs:", line, flush=True)
        for line in report["left_out"] if options.left_out else []:
            print("left out:", line)
        losses += [Loss(*loss) for loss in report["losses"]]
    print(f"{machine()}; {len(losses)} calls, {sum(loss.ratio > 1.0 for loss in losses)} of them slower than in Drake")
    print(f"\n{'CPU time of a call [us]':92s}{'ours':>10s}{'Drake':>10s}{'lost':>10s}{'ours/Drake':>12s}")
    for loss in sorted(losses, key=lambda loss: -loss.ratio):
        if loss.ratio > 1.0 or not options.slower:
            lost = loss.ours - loss.drakes
            print(f"{loss.title:92s}{loss.ours:10.2f}{loss.drakes:10.2f}{lost:10.2f}{loss.ratio:12.2f}")


if __name__ == "__main__":
    main()
