"""Ways to call and names of arguments that Drake retired since 2021."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any

from .hints import hint

if TYPE_CHECKING:
    from sheldrake.multibody.plant._multibody_plant import MultibodyPlant
    from sheldrake.systems.framework._diagram_builder import DiagramBuilder


def takes_retired_keywords(call: str, today: dict[str, str]) -> Callable:
    """Makes of a function the same that warns of arguments with retired names and takes them for today's."""

    def wrap(function: Callable) -> Callable:
        def wrapper(*args: Any, **kwargs: Any) -> Any:
            if kwargs and (retired := [name for name in kwargs if name in today]):
                hint(f"{call}(): " + ", ".join(f"{name} is now {today[name]}" for name in retired) + ".")
                kwargs = {today.get(name, name): value for name, value in kwargs.items()}
            return function(*args, **kwargs)

        return wrapper

    return wrap


def _shortest_path(function: Callable) -> Callable:
    """SolveShortestPath() that takes ids of vertices, and whether to relax instead of options."""

    def solve(self: Any, *args: Any, **kwargs: Any) -> Any:
        from sheldrake.geometry.optimization import GraphOfConvexSetsOptions

        args, kwargs = _of_ids("SolveShortestPath", self, args, kwargs)
        relaxed = kwargs.pop("convex_relaxation", args[2] if len(args) > 2 else None)
        if isinstance(relaxed, bool):
            hint("SolveShortestPath(): convex_relaxation is now a field of GraphOfConvexSetsOptions.")
            args, options = args[:2], GraphOfConvexSetsOptions()
            options.convex_relaxation = relaxed
            kwargs["options"] = options
        return function(self, *args, **kwargs)

    return solve


def _add_edge(function: Callable) -> Callable:
    """AddEdge() that takes ids of vertices."""

    def add(self: Any, *args: Any, **kwargs: Any) -> Any:
        args, kwargs = _of_ids("AddEdge", self, args, kwargs)
        return function(self, *args, **kwargs)

    return add


_BY_ID = {"source_id": "source", "target_id": "target", "u_id": "u", "v_id": "v"}


def _of_ids(call: str, graph: Any, args: tuple, kwargs: dict[str, Any]) -> tuple[tuple, dict[str, Any]]:
    """Arguments with vertices in the place of their ids."""
    from sheldrake.geometry.optimization import GraphOfConvexSets

    def vertex(value: Any) -> Any:
        if not isinstance(value, GraphOfConvexSets.VertexId):
            return value
        hint(f"{call}(): ids of vertices are retired: give the vertices.")
        return next(v for v in graph.Vertices() if v.id() == value)

    return tuple(map(vertex, args)), {_BY_ID.get(name, name): vertex(value) for name, value in kwargs.items()}


def _plant_and_scene_graph(function: Callable) -> Callable:
    """AddMultibodyPlantSceneGraph() without a plant and a time step: those of a continuous plant."""

    def add(builder: Any, *args: Any, **kwargs: Any) -> Any:
        if not args and kwargs.keys() <= {"scene_graph"}:
            hint("AddMultibodyPlantSceneGraph(): give time_step; left out, it is 0.0.")
            kwargs["time_step"] = 0.0
        return function(builder, *args, **kwargs)

    return add


def _contacts_to_lcm(function: Callable) -> Callable:
    """ConnectContactResultsToDrakeVisualizer() without the scene graph: the builder has it."""

    def connect(builder: DiagramBuilder, plant: MultibodyPlant, *args: Any, **kwargs: Any) -> Any:
        from sheldrake.geometry import SceneGraph

        if not (args and isinstance(args[0], SceneGraph)) and "scene_graph" not in kwargs:
            hint("ConnectContactResultsToDrakeVisualizer(): give scene_graph, the third argument.")
            graphs = [system for system in builder.GetSystems() if isinstance(system, SceneGraph)]
            if len(graphs) != 1:
                raise RuntimeError(
                    f"ConnectContactResultsToDrakeVisualizer(): the builder has {len(graphs)} scene graphs; say which "
                    "one: (builder, plant, scene_graph)."
                )
            kwargs.update(dict(zip(("lcm", "publish_period"), args)), scene_graph=graphs[0])
            args = ()
        return function(builder, plant, *args, **kwargs)

    return connect


def _contact_material(function: Callable) -> Callable:
    """AddContactMaterial() with the modulus of elasticity, which is a property of hydroelastic contact now."""

    def add(*args: Any, **kwargs: Any) -> Any:
        modulus = kwargs.pop("elastic_modulus", args[0] if len(args) == 5 else None)
        args = args[-4:]
        if modulus is not None:
            hint(
                "AddContactMaterial(): elastic_modulus is retired: use AddCompliantHydroelasticProperties("
                "resolution_hint, hydroelastic_modulus, properties)."
            )
            properties: Any = kwargs.get("properties", args[-1] if args else None)
            properties.UpdateProperty("hydroelastic", "hydroelastic_modulus", float(modulus))
        return function(*args, **kwargs)

    return add


def _solve(function: Callable) -> Callable:
    """Solve() of what once was a MathematicalProgram and has one now: DirectCollocation and DirectTranscription."""

    def solve(*args: Any, **kwargs: Any) -> Any:
        return function(*map(_program_of, args), **{name: _program_of(value) for name, value in kwargs.items()})

    return solve


def _program_of(value: Any) -> Any:
    if not hasattr(value, "ReconstructInputTrajectory"):  # what trajectory optimizations have, and programs have not
        return value
    hint(f"Solve(): {type(value).__name__} is no MathematicalProgram any more: give its prog().")
    return value.prog()


def _camera_poses(function: Callable) -> Callable:
    """RgbdSensor() with the poses of the two cameras in its body, which belong to the cameras now."""

    def make(self: Any, *args: Any, **kwargs: Any) -> None:
        kept = [a for a in args if not isinstance(a, CameraPoses)]
        poses = kwargs.pop("camera_poses", None) or next((a for a in args if isinstance(a, CameraPoses)), None)
        if poses is not None:
            hint("RgbdSensor(): camera_poses is retired: give RenderCameraCore its sensor_pose_in_camera_body.")
            kept, kwargs = poses.put_into(kept, kwargs)
        function(self, *kept, **kwargs)

    return make


class CameraPoses:
    """Retired: give `RenderCameraCore` its `sensor_pose_in_camera_body`.

    Attributes:
        X_BC: Pose of the camera of colours in the sensor's body.
        X_BD: Pose of the camera of depths in the sensor's body.
    """

    def __init__(self, X_BC: Any = None, X_BD: Any = None):
        from sheldrake.math import RigidTransform

        self.X_BC = RigidTransform() if X_BC is None else X_BC
        self.X_BD = RigidTransform() if X_BD is None else X_BD

    def put_into(self, args: list[Any], kwargs: dict[str, Any]) -> tuple[list[Any], dict[str, Any]]:
        """The arguments of RgbdSensor with cameras that have these poses."""
        from sheldrake.geometry import ColorRenderCamera, DepthRenderCamera

        cameras = [a for a in (*args, *kwargs.values()) if isinstance(a, ColorRenderCamera | DepthRenderCamera)]
        depth = next(camera for camera in cameras if isinstance(camera, DepthRenderCamera))
        color: Any = next((camera for camera in cameras if camera is not depth), None)
        show = bool(kwargs.pop("show_window", any(a is True for a in args)))
        color_core = _moved((color or depth).core(), self.X_BC)
        kept = [a for a in args if a not in cameras and not isinstance(a, bool)]
        other = {name: value for name, value in kwargs.items() if value not in cameras}
        other["color_camera"] = ColorRenderCamera(color_core, color.show_window() if color else show)
        other["depth_camera"] = DepthRenderCamera(_moved(depth.core(), self.X_BD), depth.depth_range())
        return kept, other


def _moved(core: Any, pose: Any) -> Any:
    """The core of a camera at another pose in its body."""
    return type(core)(core.renderer_name(), core.intrinsics(), core.clipping(), pose)


def _about_z(before: int) -> Callable:
    """Makes of a constructor of UnitInertia one that takes the z axis when `unit_vector` is left out.

    Args:
        before: How many arguments come before `unit_vector`.
    """

    def wrap(function: Callable) -> Callable:
        def make(cls: type, *args: Any, **kwargs: Any) -> Any:
            if len(args) + len(kwargs) == before and "unit_vector" not in kwargs:
                hint(f"UnitInertia.{function.__name__}() needs unit_vector now; taking the z axis.")
                kwargs["unit_vector"] = (0.0, 0.0, 1.0)
            return function(cls, *args, **kwargs)

        return make

    return wrap


def _lcm(function: Callable) -> Callable:
    """DrakeLcm() with settings beside the URL, which belong to DrakeLcmParams now."""

    def make(self: Any, *args: Any, **kwargs: Any) -> None:
        from sheldrake.lcm import DrakeLcmParams

        if len(args) == 2:
            kwargs["channel_suffix" if isinstance(args[1], str) else "defer_initialization"] = args[1]
        if not kwargs.keys() & {"channel_suffix", "defer_initialization"}:
            function(self, *args, **kwargs)
            return
        hint("DrakeLcm(): give DrakeLcmParams, which has lcm_url, channel_suffix and defer_initialization.")
        function(self, DrakeLcmParams(**dict(zip(("lcm_url",), args)), **kwargs))

    return make


def _set_option(function: Callable) -> Callable:
    """SolverOptions.SetOption() with a SolverType in the place of the solver's id."""

    from sheldrake.solvers._ids import SolverType, id_of_type

    def solver_id(value: Any) -> Any:
        if not isinstance(value, SolverType):
            return value
        hint("SolverOptions.SetOption(): SolverType is retired: give the solver's id(), as IpoptSolver.id().")
        return id_of_type(value)

    def set_option(self: Any, *args: Any, **kwargs: Any) -> None:
        if kwargs or isinstance(args[0] if args else None, SolverType):
            kwargs = {"solver_id" if name == "solver_type" else name: solver_id(v) for name, v in kwargs.items()}
            args = tuple(map(solver_id, args))
        function(self, *args, **kwargs)

    return set_option


def _csdp(function: Callable) -> Callable:
    """CsdpSolver() with how it removes free variables, which no solver here needs to."""

    def make(self: Any, *args: Any, **kwargs: Any) -> None:
        if args or "method" in kwargs:
            hint("CsdpSolver(): method is retired, and of no effect.")
            args, kwargs = (), {name: value for name, value in kwargs.items() if name != "method"}
        function(self, *args, **kwargs)

    return make


def _arm_in_parts(*names: str) -> Callable:
    """Makes of a function that takes an IiwaDriver one that takes three of its settings, as until 2024.

    Args:
        names: Those of all arguments of then, in order.
    """

    def wrap(function: Callable) -> Callable:
        def call(*args: Any, **kwargs: Any) -> Any:
            from sheldrake.manipulation import IiwaControlMode, IiwaDriver

            if any(isinstance(value, IiwaDriver) for value in (*args, *kwargs.values())):
                return function(*args, **kwargs)
            hint("Settings of an arm are those of an IiwaDriver now: give driver_config.")
            named = dict(zip(names, args), **kwargs)
            gains = named.pop("kp_gains", None)
            mode = named.pop("control_mode", IiwaControlMode.kPositionAndTorque)
            config = IiwaDriver(
                ext_joint_filter_tau=named.pop("ext_joint_filter_tau", 0.01),
                desired_kp_gains=named.pop("desired_iiwa_kp_gains", gains),
                control_mode={0: "position_only", 1: "torque_only"}.get(int(mode), "position_and_torque"),
            )
            return function(**named, driver_config=config)

        return call

    return wrap


_ARM = ("ext_joint_filter_tau", "desired_iiwa_kp_gains", "control_mode")
_CYLINDER = {"r": "radius", "L": "length", "b_E": "unit_vector"}
_WELD = {
    **dict.fromkeys(("A", "frame_on_parent_P", "parent_frame_P"), "frame_on_parent_F"),
    **dict.fromkeys(("B", "frame_on_child_C", "child_frame_C"), "frame_on_child_M"),
    **dict.fromkeys(("X_AB", "X_PC"), "X_FM"),
}
_OFFSET = {"Shift": {"p_BpBq_E": "offset"}}
_MOVING = {
    "w_WP_E": "angular_velocity_of_this_frame",
    **dict.fromkeys(("p_PoBo_E", "p_PB_E"), "position_of_moving_frame"),
    "V_PB_E": "velocity_of_moving_frame",
    "A_PB_E": "acceleration_of_moving_frame",
}
KEYWORDS: dict[str, dict[str, dict[str, dict[str, str]]]] = {
    "sheldrake.geometry": {
        **{name: {"__init__": {"absolute_filename": "filename"}} for name in ("Mesh", "Convex")},
        "MeshcatVisualizerParams": {
            "__init__": dict.fromkeys(
                ("delete_prefix_on_initialization_event", "delete_prefix_initialization_event"),
                "delete_on_initialization_event",
            )
        },
    },
    "sheldrake.multibody.math": {
        "UnitInertia": {
            "SolidCylinder": _CYLINDER,
            "SolidCylinderAboutEnd": _CYLINDER,
            "SolidCapsule": {"r": "radius", "L": "length"},
            "ThinRod": {"L": "length", "b_E": "unit_vector"},
            "AxiallySymmetric": {"J": "moment_parallel", "K": "moment_perpendicular", "b_E": "unit_vector"},
            "StraightLine": {"K": "moment_perpendicular", "b_E": "unit_vector"},
        },
        "SpatialAcceleration": {
            "Shift": {"p_PoQ_E": "offset", **_MOVING},
            "ComposeWithMovingFrameAcceleration": _MOVING,
        },
        "SpatialForce": _OFFSET,
        "SpatialMomentum": _OFFSET,
        "SpatialVelocity": {**_OFFSET, "ComposeWithMovingFrameVelocity": _MOVING},
    },
    "sheldrake.multibody.plant": {
        "MultibodyPlant": {
            "CalcJacobianSpatialVelocity": {"p_BP": "p_BoBp_B"},
            "SetDefaultFreeBodyPose": {"X_WB": "X_PB"},
            "SetFreeBodyPose": {"X_WB": "X_JpJc"},
            "SetFreeBodySpatialVelocity": {"V_WB": "V_PB"},
            "WeldFrames": _WELD,
        },
        "MultibodyPlantConfig": {"__init__": {"discrete_contact_solver": "discrete_contact_approximation"}},
    },
    "sheldrake.planning": {
        "DirectCollocation": {
            "__init__": {"minimum_timestep": "minimum_time_step", "maximum_timestep": "maximum_time_step"}
        },
        "DirectTranscription": {"__init__": {"fixed_timestep": "fixed_time_step"}},
    },
    "sheldrake.systems.sensors": {
        "RgbdSensor": {
            "__init__": {
                "color_properties": "color_camera",
                "depth_properties": "depth_camera",
                "properties": "depth_camera",
            }
        }
    },
    "sheldrake.solvers": {"SolverOptions": {"SetOption": {"solver_option": "key", "option_value": "value"}}},
    "sheldrake.systems.primitives": {"DiscreteTimeDelay": {"__init__": {"delay_timesteps": "delay_time_steps"}}},
    "sheldrake.multibody.tree": {
        "JointActuator": {"set_actuation_vector": {"u_instance": "u_actuator"}},
        "WeldJoint": {"__init__": _WELD},
    },
}
"""Retired names of arguments: module, class, method, today's name of each."""

CALLS: dict[str, dict[str, dict[str, Callable]]] = {
    "sheldrake.geometry.optimization": {
        "GraphOfConvexSets": {"AddEdge": _add_edge, "SolveShortestPath": _shortest_path},
    },
    "sheldrake.lcm": {"DrakeLcm": {"__init__": _lcm}},
    "sheldrake.multibody.math": {
        "UnitInertia": dict.fromkeys(("SolidCapsule", "SolidCylinder", "SolidCylinderAboutEnd"), _about_z(2)),
    },
    "sheldrake.manipulation": {
        "SimIiwaDriver": {
            "AddToBuilder": _arm_in_parts("builder", "plant", "iiwa_instance", "controller_plant", *_ARM),
            "__init__": _arm_in_parts("self", "control_mode", "controller_plant", "ext_joint_filter_tau", "kp_gains"),
        },
    },
    "sheldrake.solvers": {
        "CsdpSolver": {"__init__": _csdp},
        "SolverInterface": {"Solve": _solve},
        "SolverOptions": {"SetOption": _set_option},
    },
    "sheldrake.systems.sensors": {"RgbdSensor": {"__init__": _camera_poses}},
}
"""Retired ways to call methods: module, class, method, what makes of today's one that takes the old way too."""

FUNCTION_CALLS: dict[str, dict[str, Callable]] = {
    "sheldrake.geometry": {"AddContactMaterial": _contact_material},
    "sheldrake.manipulation": {
        "BuildIiwaControl": _arm_in_parts("plant", "iiwa_instance", "controller_plant", "lcm", "builder", *_ARM),
    },
    "sheldrake.multibody.plant": {
        "AddMultibodyPlantSceneGraph": _plant_and_scene_graph,
        "ConnectContactResultsToDrakeVisualizer": _contacts_to_lcm,
    },
    "sheldrake.solvers": {"Solve": _solve},
}
"""Retired ways to call functions: module, function, what makes of today's one that takes the old way too."""
