"""Every public method of plants, contexts, diagrams, geometry ... that can be called in a loop, against Drake.

    python benchmarks/every_call.py [SUBJECT ...] [--robots arm quadruped humanoid] [--scalar gradients] [--rounds 3]

Nothing is listed by hand: the methods are those of Drake's classes, their arguments are made from the signatures that
Drake's docstrings state, by name and by type (`Arguments`). Methods that only a plant which is being built allows, and
arguments that nobody here knows to make, are left out; `--left-out` names them. What both answer is compared before it
is timed. The table has the largest losses first: time lost per call [us], so that a microsecond of a getter counts as
much as one of a port. `--slower` leaves out what is no slower, `--differences` prints answers that differ only.
"""

from __future__ import annotations

import argparse
import functools
import importlib
import pathlib
import re
import statistics
import sys
import warnings
from collections.abc import Callable, Iterator
from typing import Any, NamedTuple

import numpy as np

ROOT = pathlib.Path(__file__).resolve().parents[1]
sys.path[:0] = [str(ROOT), str(ROOT / "src")]

from benchmarks.robots import arm_urdf, humanoid_urdf  # noqa: E402
from benchmarks.turns import machine, repeated_time, take_turns  # noqa: E402

SECONDS_A_TURN = 0.006
BUILDING = re.compile(
    r"Add(?!InForces|InDamping|InOneForce)|Register|Finalize|Remove|Declare|Exclude|Rename|Do[A-Z]|Mutable|SetUse|"
    r"Change|Assign|Deform|set_name|set_discrete_contact|set_contact|set_penetration|set_stiction|SetDefault|"
    r"AdvanceTo|AdvancePendingEvents|set_gravity|set_monitor|reset_|release|Graphviz|WriteToFile|Lock|Unlock|Reset$|"
    r"DisableCaching|FreezeCache|SetAllCache|set_default|set_\w*limits|set_controller|^set_\w*(inertia|ratio)$"
)
"""Names of methods that change what is asked, not a state of it."""
ENDING = re.compile(
    r"SetAbstractState|abstract_(state|parameter)$|^floating_|num_total_states|get_controller|contact_info$|"
    r"HasUniqueFree|GetUniqueFree|GetDefaultFreeBody|is_floating$"
)
"""Those with which Drake ends the process where they do not apply, and retired ones."""
OWN_AFFAIR = re.compile(
    r"num_(abstract_|numeric_|input_ports|output_ports)|has_only_discrete|ticket$|GetSystemType|FullDescription|"
    r"ToScalarType|deformable_model|FindCollisionCandidates"
)
"""Those of what each library has inside: how many groups of parameters, which pairs need a closer look ..."""


class Signature(NamedTuple):
    """One form of a method: its arguments without defaults, name and type."""

    method: str
    parameters: tuple[tuple[str, str], ...]

    def title(self) -> str:
        """As it is written: the names of the arguments."""
        return f"{self.method}({', '.join(name for name, _ in self.parameters)})"


class Loss(NamedTuple):
    """What was measured of one call [us]."""

    title: str
    ours: float
    drakes: float
    ratio: float


class Subjects:
    """A robot in a diagram on the ground, in one of the libraries, and what of it is asked."""

    def __init__(self, lib: Any, robot: str, scalar: str) -> None:
        self.lib, self.scalar = lib, scalar
        builder = lib.DiagramBuilder()
        plant, scene_graph = lib.AddMultibodyPlantSceneGraph(builder, 0.001)
        self.spring = add_robot(lib, plant, robot)
        plant.Finalize()
        self.diagram = builder.Build()
        simulator = lib.Simulator(self.diagram)
        self.root = simulator.get_mutable_context()
        if scalar != "numbers":
            plant = plant.ToAutoDiffXd() if scalar == "gradients" else plant.ToSymbolic()
            self.context = plant.CreateDefaultContext()
        else:
            self.context = plant.GetMyContextFromRoot(self.root)
        self.plant = plant
        for index in range(plant.num_input_ports()):
            port = plant.get_input_port(index)
            if "actuation" in port.get_name() and port.size():
                port.FixValue(self.context, np.zeros(port.size()))
        self.q = self.array(plant.GetPositions(plant.CreateDefaultContext()) + 0.1, "q")
        self.v = self.array(np.linspace(0.1, 0.2, plant.num_velocities()), "v")
        self.reset()
        self.subjects: dict[str, Any] = {"plant": plant, **self.parts_of_a_plant()}
        if scalar == "numbers":
            self.subjects.update(self.around_a_plant(scene_graph, simulator))
        else:
            self.subjects["context"] = self.context

    def reset(self) -> None:
        """Sets the state back to where it was."""
        self.plant.SetPositions(self.context, self.q)
        self.plant.SetVelocities(self.context, self.v)

    def array(self, numbers: Any, name: str) -> Any:
        """An array of the scalar of the plant; derivatives are by the positions."""
        if self.scalar == "gradients":
            duals = self.lib.InitializeAutoDiff(self.lib.ExtractValue(numbers).ravel()).ravel()
            return duals if name == "q" else np.array([self.lib.AutoDiffXd(x.value()) for x in duals])
        if self.scalar == "symbols":
            return np.array([self.lib.Expression(x) for x in self.lib.MakeVectorVariable(len(numbers), name)])
        return np.asarray(numbers, float)

    def parts_of_a_plant(self) -> dict[str, Any]:
        """Elements of the plant, the last of each kind."""
        plant = self.plant
        joints = [plant.get_joint(index) for index in plant.GetJointIndices()]
        self.joint = next(joint for joint in reversed(joints) if joint.num_velocities() == 1)
        self.body = self.joint.child_body()
        self.frame, self.other = self.body.body_frame(), plant.get_body(self.lib.BodyIndex(2)).body_frame()
        self.forces = self.of_scalar("MultibodyForces")(plant)
        found = {"joint": self.joint, "body": self.body, "frame": self.frame, "forces": self.forces}
        found["gravity"] = plant.gravity_field()
        if self.scalar == "numbers":
            found["spring"] = self.spring
        if plant.num_actuators():
            found["actuator"] = plant.get_joint_actuator(plant.GetJointActuatorIndices()[-1])
        return found

    def of_scalar(self, name: str) -> Any:
        """A template's class of the scalar."""
        kinds = {"numbers": float, "gradients": self.lib.AutoDiffXd, "symbols": self.lib.Expression}
        return getattr(self.lib, f"{name}_")[kinds[self.scalar]]

    def around_a_plant(self, scene_graph: Any, simulator: Any) -> dict[str, Any]:
        """What else a diagram has."""
        geometry = self.geometry = scene_graph.GetMyContextFromRoot(self.root)
        results = self.plant.get_contact_results_output_port().Eval(self.context)
        self.inspector = scene_graph.model_inspector()
        ids = self.inspector.GetAllGeometryIds(self.lib.Role.kProximity)
        self.id, self.other_id = ids[-1], ids[0]
        found = {
            "context": self.context,
            "root context": self.root,
            "diagram": self.diagram,
            "scene graph": scene_graph,
            "inspector": self.inspector,
            "query": scene_graph.get_query_output_port().Eval(geometry),
            "simulator": simulator,
            "integrator": simulator.get_mutable_integrator(),
            "contact results": results,
            "output port": self.plant.get_state_output_port(),
            "input port": self.plant.get_actuation_input_port(),
            "state": self.context.get_state(),
            "parameters": self.context.get_parameters(),
            "port of poses": self.plant.get_body_poses_output_port(),
        }
        if results.num_point_pair_contacts():
            found["point contact"] = results.point_pair_contact_info(0)
        return found


def add_robot(lib: Any, plant: Any, robot: str) -> Any:
    """A robot with a ball at each link that moves, on the ground; the damper and spring between the last two."""
    if robot == "quadruped":
        lib.Parser(plant).AddModels(str(ROOT / "src/sheldrake/models/quadruped/quadruped.urdf"))
    else:
        lib.Parser(plant).AddModelsFromString({"arm": arm_urdf, "humanoid": humanoid_urdf}[robot](), "urdf")
    if robot == "humanoid":
        for joint in [plant.get_joint(index) for index in plant.GetJointIndices()]:
            plant.AddJointActuator(f"{joint.name()}_motor", joint)
    friction = lib.CoulombFriction(0.5, 0.5)
    bodies = [plant.get_body(lib.BodyIndex(k)) for k in range(1, plant.num_bodies())]
    for body in bodies if robot != "quadruped" else []:
        plant.RegisterCollisionGeometry(body, lib.RigidTransform(), lib.Sphere(0.05), f"{body.name()}_ball", friction)
    ground = lib.RigidTransform([0.0, 0.0, -0.5])
    plant.RegisterCollisionGeometry(plant.world_body(), ground, lib.Box(9.0, 9.0, 1.0), "ground", friction)
    zero = np.zeros(3)
    return plant.AddForceElement(lib.LinearSpringDamper(bodies[-2], zero, bodies[-1], zero, 0.1, 10.0, 1.0))


class Arguments:
    """Arguments by name and type, of the objects of a library."""

    def __init__(self, own: Subjects) -> None:
        self.own = own
        plant, lib = own.plant, own.lib
        three = own.array([0.01, 0.02, 0.03], "p")
        x = np.concatenate((own.q, own.v))
        instance = own.body.model_instance()
        self.by_name: dict[str, Any] = {
            "q": own.q,
            "v": own.v,
            "q_v": x,
            "state": x,
            "qdot": own.array(np.zeros(plant.num_positions()), "d"),
            "known_vdot": own.v,
            "u": own.array(np.zeros(plant.num_actuators()), "u"),
            "u_instance": own.array(np.zeros(plant.num_actuated_dofs(instance)), "u"),
            "q_instance": own.q[: plant.num_positions(instance)],
            "v_instance": own.v[: plant.num_velocities(instance)],
            "name": own.body.name(),
            "body_indexes": [own.body.index(), own.other.body().index()],
            "body_index": own.body.index(),
            "model_instances": [instance],
            "p_WQ": np.array([0.1, 0.2, 0.3]),
            "threshold": 1.0,
            "geometry_id_A": getattr(own, "id", None),
            "geometry_id_B": getattr(own, "other_id", None),
            "geometry_id1": getattr(own, "id", None),
            "geometry_id2": getattr(own, "other_id", None),
            "frame_A": own.other,
            "frame_E": plant.world_frame(),
            "with_respect_to": lib.JacobianWrtVariable.kV,
            "time": 0.0,
            "index": 0,
            "angle": own.q[-1],
            "accuracy": 1e-3,
            "p_BQi": three,
            "p_BoBi_B": three,
            "joint_indexes": [own.joint.index()],
            "user_to_joint_index_map": [own.joint.index()],
            "user_to_actuator_index_map": list(plant.GetJointActuatorIndices()),
            "port_index": 0,
            "port_name": plant.get_output_port(0).get_name(),
            "representation": lib.HydroelasticContactRepresentation.kPolygon,
            "X_JpJc": own.of_scalar("RigidTransform")(three),
            "joint_dof": 0,
            "joint_tau": 1.0,
            "damping": [0.1],
            "xd": x,
            "i": 0,
            "value": x,
        }
        self.by_method: dict[str, Any] = {
            "GetJointByName": own.joint.name(),
            "GetModelInstanceByName": plant.GetModelInstanceName(instance),
            "GetSubsystemByName": "plant",
            "GetJointActuatorByName": plant.get_joint_actuator(plant.GetJointActuatorIndices()[-1]).name(),
        }
        self.contexts = {name: own.root for name in ("diagram", "simulator", "root context")}
        if own.scalar == "numbers":
            self.contexts["scene graph"] = own.geometry
        prefix = "pydrake."
        rotation = own.of_scalar("RotationMatrix")()
        self.by_type: dict[str, Any] = {
            f"{prefix}systems.framework.Context": own.context,
            f"{prefix}multibody.tree.ModelInstanceIndex": instance,
            f"{prefix}multibody.tree.BodyIndex": own.body.index(),
            f"{prefix}multibody.tree.JointIndex": own.joint.index(),
            f"{prefix}multibody.tree.FrameIndex": own.frame.index(),
            f"{prefix}multibody.tree.RigidBody": own.body,
            f"{prefix}multibody.tree.Frame": own.frame,
            f"{prefix}multibody.tree.Joint": own.joint,
            f"{prefix}multibody.tree.MultibodyForces": own.forces,
            f"{prefix}math.RigidTransform": own.of_scalar("RigidTransform")(three),
            f"{prefix}math.RotationMatrix": rotation,
            f"{prefix}multibody.math.SpatialVelocity": own.of_scalar("SpatialVelocity")(three, three),
            f"{prefix}geometry.GeometryId": getattr(own, "id", None),
            f"{prefix}geometry.FrameId": plant.GetBodyFrameIdIfExists(own.body.index()),
            f"{prefix}multibody.tree.JointActuatorIndex": plant.GetJointActuatorIndices()[-1],
            f"{prefix}multibody.tree.ForceElementIndex": lib.ForceElementIndex(0),
            f"{prefix}geometry.Role": lib.Role.kProximity,
            f"{prefix}common._random.RandomGenerator": lib.RandomGenerator(1),
            f"{prefix}common.RandomGenerator": lib.RandomGenerator(1),
            f"{prefix}systems.framework.System": own.diagram,
            "numpy.ndarray[numpy.float64[3, 1]]": three,
            "numpy.ndarray[numpy.float64[3, n]]": three[:, None],
            "numpy.ndarray[numpy.float64[m, n]]": three[:, None],
            "numpy.ndarray[object[3, 1]]": three,
            "numpy.ndarray[object[m, n]]": three[:, None],
            "float": 0.1,
        }

    def made(self, form: Signature, subject: str) -> list[Any] | None:
        """The arguments of a signature; None if one of them is unknown."""
        values = []
        for name, kind in form.parameters:
            plain = re.sub("_𝓣.*?𝓤", "", kind)  # the scalar of a template
            if plain.endswith("framework.Context"):
                value = self.own.root if name == "root_context" else self.contexts.get(subject, self.own.context)
            elif name == "name" and form.method in self.by_method:
                value = self.by_method[form.method]
            elif plain.endswith("tree.RigidBody") and re.search("Free|Floating", form.method):
                value = next(map(self.own.plant.get_body, self.own.plant.GetFloatingBaseBodies()), None)
            elif name in self.by_name and not (name == "state" and "State" in plain):
                value = self.by_name[name]
            else:
                value = self.by_type.get(plain)
            if value is None:
                return None
            values.append(value)
        return values


def signatures(kind: type) -> Iterator[Signature]:
    """The forms of the public methods of one of Drake's classes."""
    for method in dir(kind):
        if method.startswith("_") or any(names.search(method) for names in (BUILDING, ENDING, OWN_AFFAIR)):
            continue
        text = getattr(kind, method).__doc__ or ""
        for form in re.finditer(rf"^(?:\d+\. )?{method}\(self: [^,)]+(?:, (.*))?\) -> ", text, re.MULTILINE):
            yield Signature(method, tuple(parameters(form[1] or "")))


def parameters(text: str) -> Iterator[tuple[str, str]]:
    """Names and types of what has no default."""
    for part in re.split(r", (?=\w+: )", text):
        name, _, kind = part.partition(": ")
        if kind and " = " not in kind:
            yield name, kind


def same(a: Any, b: Any) -> bool:
    """Whether two answers agree, as far as they are numbers, words or nothing."""
    if hasattr(a, "GetAsMatrix34"):
        a, b = a.GetAsMatrix34(), b.GetAsMatrix34()
    for read in ("get_coeffs", "CopyToFullMatrix6", "CopyToVector", "CopyToFullMatrix3"):
        if hasattr(a, read):
            a, b = getattr(a, read)(), getattr(b, read)()
    if isinstance(a, (bool, str)) or isinstance(b, (bool, str)):
        return bool(a == b)
    if isinstance(a, (list, tuple)) and isinstance(b, (list, tuple)):
        return len(a) == len(b) and all(same(x, y) for x, y in zip(a, b))
    if type(a).__name__.endswith(("Id", "Ticket")):  # which numbers things have is each library's own affair
        return type(a).__name__ == type(b).__name__
    a, b = numbers_of(a, b)
    try:
        x, y = np.asarray(a, dtype=float), np.asarray(b, dtype=float)
    except (TypeError, ValueError, RuntimeError):
        return (a is None) == (b is None)
    if x.shape != y.shape:
        return False
    largest = float(np.max(np.abs(y[np.isfinite(y)]), initial=1e-4))
    return bool(np.allclose(x, y, rtol=0.0, atol=1e-5 * largest, equal_nan=True))  # as contact solvers converge


def numbers_of(a: Any, b: Any) -> tuple[Any, Any]:
    """Two answers; where they are duals values and derivatives, of which those that one has not are zero."""
    flat = [np.ravel(np.asarray(given, dtype=object)) for given in (a, b)]
    if not all(len(found) and all(hasattr(x, "derivatives") for x in found) for found in flat):
        return a, b
    n = max(len(x.derivatives()) for found in flat for x in found)
    rows = [[[x.value(), *np.resize(np.append(x.derivatives(), np.zeros(n)), n)] for x in found] for found in flat]
    return rows[0], rows[1]


def enough(call: Callable[[], Any]) -> int:
    """So many calls that a turn takes long enough to be measured."""
    if repeated_time(call, 1) > 2e5:
        return 1
    return max(1, int(SECONDS_A_TURN * 1e6 / max(repeated_time(call, 3), 0.05)))


def measured(title: str, calls: dict[str, Callable[[], Any]], rounds: int) -> Loss:
    """One call of both libraries, in turns."""
    turns: dict[str, Callable[[], float]] = {}
    for name, call in calls.items():
        turns[name] = functools.partial(repeated_time, call, enough(call))
    times = take_turns(turns, rounds)
    ours, drakes = times["sheldrake"], times["pydrake"]
    return Loss(title, min(ours), min(drakes), statistics.median(a / b for a, b in zip(ours, drakes)))


def outcome(call: Callable[[], Any]) -> tuple[Any, Exception | None]:
    """What a call answers, or what it raises."""
    try:
        return call(), None
    except Exception as error:  # whatever a library objects to
        return None, error


class Sweep:
    """Both libraries on one robot."""

    def __init__(self, robot: str, scalar: str) -> None:
        libraries = {name: importlib.import_module(f"{name}.all") for name in ("sheldrake", "pydrake")}
        self.own = {name: Subjects(lib, robot, scalar) for name, lib in libraries.items()}
        self.arguments = {name: Arguments(own) for name, own in self.own.items()}
        self.prefix = f"{robot}, " + (f"{scalar}, " if scalar != "numbers" else "")
        self.left_out: list[str] = []
        self.differences: list[str] = []

    def calls(self, chosen: list[str], only: str) -> Iterator[tuple[str, dict[str, Callable[[], Any]]]]:
        """What both can be asked and answer alike."""
        for name, subject in self.own["pydrake"].subjects.items():
            if chosen and name not in chosen:
                continue
            for form in signatures(type(subject)):
                title = f"{self.prefix}{name}.{form.title()}"
                if re.search(only, title):
                    calls = self.call(name, form, title)
                    if calls is not None:
                        yield title, calls

    def call(self, name: str, form: Signature, title: str) -> dict[str, Callable[[], Any]] | None:
        """One method with its arguments in both libraries, if there it answers."""
        calls: dict[str, Callable[[], Any]] = {}
        for library in ("pydrake", "sheldrake"):
            subject = self.own[library].subjects[name]
            given = self.arguments[library].made(form, name)
            if given is None:
                self.left_out.append(title)
                return None
            self.own[library].reset()
            calls[library] = functools.partial(getattr(subject, form.method, missing), *given)
        drakes, refused = outcome(calls["pydrake"])
        if refused is not None:
            self.left_out.append(f"{title}: {str(refused).splitlines()[0][:90] if str(refused) else refused!r}")
            return None
        ours, error = outcome(calls["sheldrake"])
        if error is not None:
            self.differences.append(f"{title}: {type(error).__name__}: {str(error)[:150]}")
            return None
        if not same(ours, drakes):
            self.differences.append(f"{title}: {str(ours)[:100]!r} instead of {str(drakes)[:100]!r}")
        return calls


def missing(*given: Any) -> None:
    """In the place of a method that we have not."""
    raise AttributeError("no such method")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("subjects", nargs="*")
    parser.add_argument("--robots", nargs="*", default=["arm", "quadruped", "humanoid"])
    parser.add_argument("--scalar", choices=("numbers", "gradients", "symbols"), default="numbers")
    parser.add_argument("--rounds", type=int, default=3)
    parser.add_argument("--only", default="", help="calls whose title contains this regular expression")
    parser.add_argument("--slower", action="store_true")
    parser.add_argument("--left-out", action="store_true")
    parser.add_argument("--differences", action="store_true")
    options = parser.parse_args()
    losses, differences, left_out = [], [], []
    importlib.import_module("pydrake.all")  # which sets filters of its own
    warnings.simplefilter("ignore")
    for robot in options.robots:
        sweep = Sweep(robot, options.scalar)
        for title, calls in sweep.calls(options.subjects, options.only):
            if not options.differences:
                losses.append(measured(title, calls, options.rounds))
        differences += sweep.differences
        left_out += sweep.left_out
    print(f"{machine()}; {len(losses)} calls, {sum(loss.ratio > 1.0 for loss in losses)} of them slower than in Drake")
    for line in differences:
        print("differs:", line)
    for line in left_out if options.left_out else []:
        print("left out:", line)
    print(f"\n{'CPU time of a call [us]':92s}{'ours':>10s}{'Drake':>10s}{'lost':>10s}{'ours/Drake':>12s}")
    for loss in sorted(losses, key=lambda loss: loss.drakes - loss.ours):
        if loss.ratio > 1.0 or not options.slower:
            lost = loss.ours - loss.drakes
            print(f"{loss.title:92s}{loss.ours:10.2f}{loss.drakes:10.2f}{lost:10.2f}{loss.ratio:12.2f}")


if __name__ == "__main__":
    main()
