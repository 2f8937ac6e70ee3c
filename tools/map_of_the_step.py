"""The map of a step: its kernels in order, where they stand, which arrays they read and write.

    python tools/map_of_the_step.py            prints it
    python tools/map_of_the_step.py --write    puts it into ARCHITECTURE.md

It is made from what a plant gives to the framework and from the kernels' own sources: an array is written if an
assignment in the kernel, or in one that it calls, reaches it.
"""

from __future__ import annotations

import argparse
import ast
import functools
import inspect
import pathlib
import sys
import textwrap
from collections.abc import Iterator

from sheldrake.common.kernel import Kernel

ROOT = pathlib.Path(__file__).resolve().parents[1]
PAGE = ROOT / "ARCHITECTURE.md"
BEGIN, END = "<!-- made by tools/map_of_the_step.py -->", "<!-- end of the map -->"
SCENE = """
<robot name="part">
  <link name="world"/>
  <link name="part">
    <inertial><mass value="1"/><inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial>
    <collision><geometry><box size="0.1 0.1 0.1"/></geometry>PROPERTIES</collision>
  </link>
  <joint name="slide" type="prismatic">
    <parent link="world"/><child link="part"/><axis xyz="0 0 1"/><limit lower="0" upper="1" effort="9"/>
  </joint>
</robot>
"""
COMPLIANT = "<drake:proximity_properties><drake:compliant_hydroelastic/><drake:hydroelastic_modulus value='1e6'/>"
COMPLIANT += "<drake:mesh_resolution_hint value='0.1'/></drake:proximity_properties>"


def stages(approximation: str = "kLagged", soft: bool = False) -> list[Kernel]:
    """The kernels of a plant's step: a part on a slider and a plate, which touch in points or along a surface."""
    from sheldrake import all as sheldrake

    builder = sheldrake.DiagramBuilder()
    plant, _ = sheldrake.AddMultibodyPlantSceneGraph(builder, 1e-3)
    plant.set_discrete_contact_approximation(getattr(sheldrake.DiscreteContactApproximation, approximation))
    text = SCENE.replace("PROPERTIES", COMPLIANT if soft else "").replace("<robot", '<robot xmlns:drake="drake"')
    sheldrake.Parser(plant).AddModelsFromString(text, "urdf")
    weight = sheldrake.SpatialInertia.SolidBoxWithMass(9.0, 1.0, 1.0, 0.1)
    ground = plant.AddRigidBody("ground", plant.GetModelInstanceByName("part"), weight)
    friction = sheldrake.CoulombFriction(0.5, 0.5)
    material = sheldrake.ProximityProperties()
    sheldrake.AddContactMaterial(friction=friction, properties=material)
    sheldrake.AddRigidHydroelasticProperties(0.1, material)
    box = sheldrake.Box(1.0, 1.0, 0.1)
    plant.RegisterCollisionGeometry(ground, sheldrake.RigidTransform(), box, "box", material)
    plant.Finalize()
    context = plant.GetMyContextFromRoot(builder.Build().CreateDefaultContext())
    advance = plant._parts.advance
    return advance.equations.stages(advance._models.of(True, advance._models.geometry_of(context)))


# --- what a kernel does with its arguments


@functools.cache
def tree_of(kernel: Kernel) -> ast.FunctionDef:
    """The kernel's source as a tree."""
    tree = ast.parse(textwrap.dedent(inspect.getsource(kernel.py_func))).body[0]
    assert isinstance(tree, ast.FunctionDef)
    return tree


def called(kernel: Kernel) -> dict[str, Kernel]:
    """Kernels by the names that this one calls them by."""
    known = inspect.getclosurevars(kernel.py_func)
    names = {**known.globals, **known.nonlocals}
    return {n: k for n, k in names.items() if isinstance(k, Kernel)}


def reached(kernels: list[Kernel]) -> list[Kernel]:
    """These kernels and all that they call."""
    found: dict[int, Kernel] = {}
    waiting = list(kernels)
    while waiting:
        kernel = waiting.pop()
        if id(kernel) not in found:
            found[id(kernel)] = kernel
            waiting += called(kernel).values()
    return list(found.values())


@functools.cache
def written(kernel: Kernel, functions: frozenset[tuple[str, Kernel]] = frozenset()) -> frozenset[str]:
    """The parameters, or `parameter.field` of those that are tuples of arrays, that a kernel writes to.

    Args:
        kernel: the kernel.
        functions: by the names of its parameters, the kernels that it is given.
    """
    tree, callees = tree_of(kernel), called(kernel) | dict(functions)
    places = {a.arg: a.arg for a in tree.args.args}
    found: set[str] = set()
    for node in ast.walk(tree):
        for target, value in _bindings(node):
            if (place := _place(value, places)) is not None:
                places.setdefault(target, place)
    for node in ast.walk(tree):
        found.update(_stored(node, places))
        if isinstance(node, ast.Call) and isinstance(node.func, ast.Name) and node.func.id in callees:
            found.update(_stored_by_call(node, callees, places))
    return frozenset(found)


def _bindings(node: ast.AST) -> Iterator[tuple[str, ast.expr]]:
    """Names that stand for a part of something: by an assignment or a loop."""
    if isinstance(node, ast.For):
        pairs: list[tuple[ast.expr, ast.expr]] = [(node.target, node.iter)]
    elif isinstance(node, ast.Assign):
        pairs = [(t, node.value) for t in node.targets]
    else:
        return
    for target, value in pairs:
        if isinstance(target, ast.Name):
            yield target.id, value
        elif isinstance(target, ast.Tuple) and isinstance(value, ast.Tuple):
            yield from ((t.id, v) for t, v in zip(target.elts, value.elts) if isinstance(t, ast.Name))


def _place(value: ast.expr, places: dict[str, str]) -> str | None:
    """Which argument, or field of one, an expression is a part of."""
    fields: list[str] = []
    while isinstance(value, (ast.Attribute, ast.Subscript)):
        fields = [value.attr] if isinstance(value, ast.Attribute) else []
        value = value.value
    if not isinstance(value, ast.Name) or value.id not in places:
        return None
    place = places[value.id]
    return place if "." in place or not fields else ".".join([place, *fields])


def _stored(node: ast.AST, places: dict[str, str]) -> set[str]:
    targets: list[ast.expr] = []
    if isinstance(node, ast.Assign):
        targets = [e for t in node.targets for e in (t.elts if isinstance(t, ast.Tuple) else [t])]
    elif isinstance(node, ast.AugAssign):
        targets = [node.target]
    kept = [t for t in targets if isinstance(t, (ast.Subscript, ast.Attribute))]
    return {place for t in kept if (place := _place(t, places)) is not None}


def _stored_by_call(call: ast.Call, callees: dict[str, Kernel], places: dict[str, str]) -> set[str]:
    assert isinstance(call.func, ast.Name)
    callee = callees[call.func.id]
    given = dict(zip((a.arg for a in tree_of(callee).args.args), call.args))
    given |= {k.arg: k.value for k in call.keywords if k.arg}
    functions = {n: callees[v.id] for n, v in given.items() if isinstance(v, ast.Name) and v.id in callees}
    found = set()
    for path in written(callee, frozenset(functions.items())):
        name, _, field = path.partition(".")
        if name in given and (place := _place(given[name], places)) is not None:
            found.add(place if "." in place or not field else f"{place}.{field}")
    return found


_OPEN: set[str] = set()


# --- the map


def row(kernel: Kernel) -> str:
    """A line of the table."""
    file = pathlib.Path(inspect.getfile(kernel.py_func)).relative_to(ROOT / "src" / "sheldrake")
    writes = sorted({path.partition(".")[0] for path in written(kernel)})
    reads = [a.arg for a in tree_of(kernel).args.args if a.arg not in writes]
    what = (inspect.getdoc(kernel.py_func) or "").partition("\n")[0].rstrip(".")
    return f"| `{kernel.py_func.__name__}` | `{file}` | {what} | {_names(reads)} | {_names(writes)} |"


def _names(names: list[str]) -> str:
    return ", ".join(f"`{n}`" for n in names)


def files(kernels: list[Kernel]) -> list[str]:
    """The files in which kernels stand."""
    return sorted({inspect.getfile(k.py_func) for k in kernels})


def text() -> str:
    """The map."""
    points, soft, tamsi = stages(), stages(soft=True), stages("kTamsi")
    known = {k.py_func.__name__ for k in points}
    more = [k for k in [*soft, *tamsi] if k.py_func.__name__ not in known]
    head = ["| kernel | file | what it does | reads | reads and writes |", "|---|---|---|---|---|"]
    everything = reached(points)
    return "\n".join(
        [
            *head,
            *map(row, points),
            "",
            f"With what they call these are {len(everything)} kernels in {len(files(everything))} files. "
            "Where surfaces touch, and for kTamsi, there run too:",
            "",
            *head,
            *map(row, dict.fromkeys(more)),
        ]
    )


def main() -> int:
    """What the command does."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("--write", action="store_true", help="puts the map into ARCHITECTURE.md")
    if not parser.parse_args().write:
        print(text())
        return 0
    before, _, rest = PAGE.read_text(encoding="utf-8").partition(BEGIN)
    PAGE.write_text(f"{before}{BEGIN}\n{text()}\n{END}{rest.partition(END)[2]}", encoding="utf-8")
    return 0


if __name__ == "__main__":
    sys.exit(main())
