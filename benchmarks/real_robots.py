"""Sixty robots of example-robot-data fall: CPU time of a 1 ms step in sheldrake, Drake and MuJoCo.

    python benchmarks/real_robots.py [name ...] [--keep FILE] [--hulls FOLDER] [--write docs/performance.md]
    python benchmarks/real_robots.py panda_collision --dissipation 1
    python benchmarks/real_robots.py panda_collision --time-constant 1

Needs `pip install "sheldrake[kernels,peers,robots]"`. With --keep, robots that FILE (JSON) has are not measured again;
with --hulls, meshes whose hulls are in FOLDER are not read again.

Each robot starts in the posture of its zeros, a metre above flat ground, without motors; what its file welds to the
world stays there. What is compared is made as
equal as the engines allow: meshes are replaced by their convex hulls once, for everybody; and the pairs of bodies that
MuJoCo never tests, those on the two sides of one joint with all that is welded to them, are excluded in sheldrake and
in Drake too. Contacts are counted at every hundredth of a second of another fall: sheldrake and MuJoCo find several
points where faces touch, Drake one; "one point" is sheldrake with one. "-" is a robot that an engine can not read or
not simulate.

Limbs that overlap in the posture of zeros do so in all engines, as deep at first, but MuJoCo throws them apart within
some steps. With Drake's law and its dissipation of 50 s/m, sheldrake's too, a contact does not push what parts faster
than 1 / 50 m/s, and they overlap until the end of the fall. Where MuJoCo holds far fewer contacts, as of
panda_collision, it has less to do; with `--dissipation 1` those limbs part in all engines, with `--time-constant 1` in
none.
"""

from __future__ import annotations

import argparse
import hashlib
import importlib
import json
import pathlib
import re
import subprocess
import sys
import tempfile
import time
import warnings

import numpy as np

ROOT = pathlib.Path(__file__).resolve().parents[1]
sys.path[:0] = [str(ROOT), str(ROOT / "src")]

from benchmarks.tables import replace_table  # noqa: E402
from benchmarks.turns import machine  # noqa: E402
from tests.crosscheck.robots.real_robots import robot_files, robots_folder  # noqa: E402

DT, HEIGHT, SAMPLE = 1e-3, 1.0, 0.01
FALLS, MOST_FALLS, ENOUGH = 3, 60, 0.3
"""The least and the largest number of falls, and time that is enough for them [s]."""
DISSIPATION = 50.0
"""Drake's default [s/m]."""
TIME_CONSTANT = 0.02
"""MuJoCo's default [s]."""
ENGINES = ("sheldrake", "one point", "Drake", "MuJoCo")
MESH = re.compile(r'filename="([^"]*\.(?:dae|stl|ply|obj))"', re.IGNORECASE)


def with_hulls(path: pathlib.Path, folder: pathlib.Path, visuals: bool = False) -> pathlib.Path:
    """A copy of a description in `folder`, whose meshes are OBJ files of their convex hulls; visuals if asked for."""
    from sheldrake.geometry import Convex

    def hull_of(match: re.Match) -> str:
        name = match[1].removeprefix("file://")
        mesh = robots_folder().parent / name.removeprefix("package://example-robot-data/")
        mesh = mesh if name.startswith("package://") else path.parent / name
        out = folder / (hashlib.sha256(str(mesh).encode()).hexdigest()[:16] + ".obj")
        if not out.exists():
            hull = Convex(str(mesh), 1.0).GetConvexHull()
            points = (hull.vertex(i) for i in range(hull.num_vertices()))
            faces = (hull.element(i) for i in range(hull.num_elements()))
            lines = ["v {:.9g} {:.9g} {:.9g}".format(*x) for x in points]
            lines += ["f " + " ".join(str(f.vertex(k) + 1) for k in range(f.num_vertices())) for f in faces]
            out.write_text("\n".join(lines) + "\n")
        return f'filename="{out}"'

    text = path.read_text() if visuals else re.sub(r"<visual.*?</visual>", "", path.read_text(), flags=re.S)
    out = folder / f"{path.parts[-3]}_{path.name}"
    out.write_text(MESH.sub(hull_of, text))
    return out


def exclude_neighbours(lib, plant, scene_graph) -> None:
    """No contact between the two sides of a joint, each with what is welded to it."""
    manager = scene_graph.collision_filter_manager()
    for index in plant.GetJointIndices():
        joint = plant.get_joint(index)
        sides = [plant.GetBodiesWeldedTo(body) for body in (joint.parent_body(), joint.child_body())]
        if joint.num_velocities() and plant.world_body() not in sides[0] + sides[1]:
            a, b = (plant.CollectRegisteredGeometries(side) for side in sides)
            manager.Apply(lib.CollisionFilterDeclaration().ExcludeBetween(a, b))


def add_ground(lib, plant) -> None:
    """Flat ground, below the origin."""
    ground = plant.world_body(), lib.RigidTransform([0.0, 0.0, -HEIGHT]), lib.HalfSpace(), "ground"
    plant.RegisterCollisionGeometry(*ground, lib.CoulombFriction(1.0, 1.0))


def fall_like_drake(package: str, path: pathlib.Path, seconds: float, dissipation: float, single: bool = False) -> dict:
    """A fall in sheldrake or pydrake, with the dissipation of all contacts [s/m]."""
    lib = importlib.import_module(f"{package}.all")
    builder = lib.DiagramBuilder()
    plant, scene_graph = lib.AddMultibodyPlantSceneGraph(builder, DT)
    config = lib.SceneGraphConfig()
    config.default_proximity_properties.hunt_crossley_dissipation = dissipation
    scene_graph.set_config(config)
    if single:
        scene_graph.set_default_point_contact_algorithm("single_point")
    lib.Parser(plant).AddModels(str(path))
    add_ground(lib, plant)
    plant.Finalize()
    exclude_neighbours(lib, plant, scene_graph)
    diagram = builder.Build()
    simulator = lib.Simulator(diagram)
    results = plant.get_contact_results_output_port()

    def begin() -> None:
        simulator.reset_context(diagram.CreateDefaultContext())
        simulator.Initialize()

    def contacts() -> int:
        return results.Eval(plant.GetMyContextFromRoot(simulator.get_context())).num_point_pair_contacts()

    return {"nv": plant.num_velocities(), **timed(begin, simulator.AdvanceTo, contacts, seconds)}


def fall_in_mujoco(path: pathlib.Path, seconds: float, time_constant: float) -> dict:
    """A fall in MuJoCo, with the time in which all contacts part [s]."""
    import mujoco

    bounds = 'balanceinertia="true" boundmass="1e-6" boundinertia="1e-9"'  # some links have no mass
    compiler = f'<compiler strippath="false" discardvisual="true" fusestatic="false" {bounds}/>'
    options = f'<mujoco>{compiler}<option timestep="{DT}"/></mujoco>'
    text = path.read_text()
    spec = mujoco.MjSpec.from_string(re.sub(r"(<robot[^>]*>)", rf"\1{options}", text, count=1))
    welded = re.search(r'<link\s+name="world"', text)
    for body in spec.worldbody.bodies:
        if not (body.joints or welded):
            body.add_freejoint()
    spec.worldbody.add_geom(type=mujoco.mjtGeom.mjGEOM_PLANE, size=[0, 0, 1], pos=[0, 0, -HEIGHT])
    model = spec.compile()
    model.geom_solref[:, 0] = time_constant
    data = mujoco.MjData(model)

    def advance_to(t: float) -> None:
        mujoco.mj_step(model, data, round((t - data.time) / DT))

    return {"nv": model.nv, **timed(lambda: mujoco.mj_resetData(model, data), advance_to, lambda: data.ncon, seconds)}


def timed(begin, advance_to, contacts, seconds: float) -> dict:
    """CPU time of a step [us], the best of several falls, and mean number of contacts.

    A fall may take half a millisecond: then what other processes do to caches makes three of them twice as long.
    """
    spent: list[float] = []
    while len(spent) < FALLS or (sum(spent) < ENOUGH and len(spent) < MOST_FALLS):
        begin()
        advance_to(DT)
        start = time.process_time()
        advance_to(seconds)
        spent.append(time.process_time() - start)
    begin()
    found = []
    for k in range(1, round(seconds / SAMPLE) + 1):
        advance_to(k * SAMPLE)
        found.append(contacts())
    return {"us": min(spent) / round(seconds / DT - 1) * 1e6, "contacts": float(np.mean(found))}


def fall(engine: str, path: pathlib.Path, seconds: float, dissipation: float, time_constant: float) -> dict:
    """Time and contacts of one robot in one engine."""
    if engine == "MuJoCo":
        return fall_in_mujoco(path, seconds, time_constant)
    package = "pydrake" if engine == "Drake" else "sheldrake"
    return fall_like_drake(package, path, seconds, dissipation, engine == "one point")


def in_own_process(
    engine: str, path: pathlib.Path, seconds: float, dissipation: float, time_constant: float
) -> dict | None:
    """`fall` in a process that may fail, or take for ever."""
    numbers = {"--seconds": seconds, "--dissipation": dissipation, "--time-constant": time_constant}
    given = [text for name, number in numbers.items() for text in (name, str(number))]
    command = [sys.executable, __file__, "--engine", engine, str(path), *given]
    try:
        done = subprocess.run(command, capture_output=True, text=True, timeout=600)
    except subprocess.TimeoutExpired:
        return None
    return json.loads(done.stdout.splitlines()[-1]) if done.returncode == 0 else None


def ratio(found: dict[str, dict | None], engine: str) -> float:
    """How many times sheldrake's time an engine took; NaN if one of them could not."""
    ours, f = found["sheldrake"], found[engine]
    return f["us"] / ours["us"] if f and ours else float("nan")


def line(name: str, found: dict[str, dict | None]) -> str:
    """One robot: velocities, then of each engine time, contacts, and how many times sheldrake's time it took."""
    ours = found["sheldrake"]
    cells = []
    for engine in ENGINES:
        f = found[engine]
        times = f"{f['us']:8.2f}{f['contacts']:6.1f}" if f else f"{'-':>8s}{'-':>6s}"
        cells.append(times + (f"{ratio(found, engine):6.1f}x" if f and ours else f"{'-':>7s}"))
    return f"{name:44s}{ours['nv'] if ours else '-':>4}" + " ".join(cells)


def medians(table: dict[str, dict]) -> str:
    """How all robots fare together."""
    ratios = {engine: np.array([ratio(found, engine) for found in table.values()]) for engine in ("MuJoCo", "Drake")}
    parts = [
        f"{engine} / ours: median {np.nanmedian(r):.1f}, least {np.nanmin(r):.2f}, {np.sum(r < goal)} below {goal}"
        for (engine, r), goal in zip(ratios.items(), (2, 20))
    ]
    return f"{len(table)} robots. " + "; ".join(parts) + "."


def page_table(table: dict[str, dict]) -> str:
    """As in the documentation, slowest against MuJoCo first."""

    def cell(f: dict | None) -> str:
        return f"{f['us']:.3g} ({f['contacts']:.3g})" if f else "–"

    def times(x: float) -> str:
        return f"{x:.2g}" if x == x else "–"

    lines = [
        "| µs a step (contacts) | sheldrake | one point a pair | Drake | MuJoCo | MuJoCo / ours | Drake / ours |",
        "|---|---|---|---|---|---|---|",
    ]
    for name, found in sorted(table.items(), key=lambda item: np.nan_to_num(ratio(item[1], "MuJoCo"), nan=np.inf)):
        nv = found["sheldrake"]["nv"] if found["sheldrake"] else "–"
        cells = [cell(found[engine]) for engine in ENGINES]
        cells += [times(ratio(found, engine)) for engine in ("MuJoCo", "Drake")]
        lines.append(f"| {name}, nv = {nv} | " + " | ".join(cells) + " |")
    return "\n".join([*lines, "", medians(table)])


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("names", nargs="*", help="parts of paths; all robots without any")
    parser.add_argument("--seconds", type=float, default=0.3)
    parser.add_argument("--dissipation", type=float, default=DISSIPATION, help="of contacts, but MuJoCo's [s/m]")
    parser.add_argument("--time-constant", type=float, default=TIME_CONSTANT, help="of MuJoCo's contacts [s]")
    parser.add_argument("--keep", type=pathlib.Path, metavar="FILE", help="numbers found so far, as JSON")
    parser.add_argument("--hulls", type=pathlib.Path, metavar="FOLDER", help="where hulls of meshes are kept")
    parser.add_argument("--write", type=pathlib.Path, metavar="PAGE", help="put the table into this page")
    parser.add_argument("--engine", choices=ENGINES, help=argparse.SUPPRESS)
    options = parser.parse_args()
    numbers = options.seconds, options.dissipation, options.time_constant
    if options.engine:
        warnings.simplefilter("ignore")
        print(json.dumps(fall(options.engine, pathlib.Path(options.names[0]), *numbers)))
        return
    print(machine())
    print(f"{'us a step, contacts, ratio of times':44s}{'nv':>4s}" + " ".join(f"{engine:>21s}" for engine in ENGINES))
    table = json.loads(options.keep.read_text()) if options.keep and options.keep.exists() else {}
    with tempfile.TemporaryDirectory() as folder:
        for path in robot_files("urdf"):
            name = f"{path.parts[-3].removesuffix('_description')} {path.stem}"
            if name in table or (options.names and not any(part in str(path) for part in options.names)):
                continue
            try:
                copy = with_hulls(path, options.hulls or pathlib.Path(folder))
            except (RuntimeError, ValueError, OSError):
                continue  # files that the package does not contain
            table[name] = {engine: in_own_process(engine, copy, *numbers) for engine in ENGINES}
            print(line(name, table[name]), flush=True)
            if options.keep:
                options.keep.write_text(json.dumps(table, indent=1) + "\n")
    print(medians(table))
    if options.write:
        replace_table(options.write, "real_robots", page_table(table))


if __name__ == "__main__":
    main()
