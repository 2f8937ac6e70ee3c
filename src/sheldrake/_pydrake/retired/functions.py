"""Functions and classes that Drake retired since 2021, made of what took their place; see `_retired`."""

from __future__ import annotations

import warnings
from collections.abc import Callable
from typing import TYPE_CHECKING, Any

from .hints import forwarded, hint

if TYPE_CHECKING:
    import numpy as np

    from sheldrake.multibody.plant._multibody_plant import MultibodyPlant
    from sheldrake.multibody.tree._frame import Frame
    from sheldrake.systems.framework._context.context import Context
    from sheldrake.systems.framework._diagram_builder import DiagramBuilder
    from sheldrake.systems.framework._port import OutputPort
    from sheldrake.systems.framework._system import System


def _autodiffutils() -> dict[str, Any]:
    import numpy as np

    from sheldrake import autodiffutils as m

    def with_gradient(value: Any, gradient: Any) -> Any:
        return m.InitializeAutoDiff(np.asarray(value, dtype=float), gradient=gradient)

    return {
        "initializeAutoDiff": forwarded(m.InitializeAutoDiff, "initializeAutoDiff"),
        "initializeAutoDiffTuple": forwarded(m.InitializeAutoDiffTuple, "initializeAutoDiffTuple"),
        "initializeAutoDiffGivenGradientMatrix": forwarded(
            with_gradient, "initializeAutoDiffGivenGradientMatrix", "InitializeAutoDiff(value, gradient=gradient)"
        ),
        "autoDiffToValueMatrix": forwarded(m.ExtractValue, "autoDiffToValueMatrix"),
        "autoDiffToGradientMatrix": forwarded(m.ExtractGradient, "autoDiffToGradientMatrix"),
    }


def _visualization() -> dict[str, Any]:
    from .meshcat_visualizer import ConnectMeshcatVisualizer

    return {"ConnectMeshcatVisualizer": ConnectMeshcatVisualizer}


def _geometry() -> dict[str, Any]:
    from sheldrake.geometry import (
        AddCompliantHydroelasticProperties,
        AddCompliantHydroelasticPropertiesForHalfSpace,
        DrakeVisualizer,
        MeshcatPointCloudVisualizer,
        MeshcatVisualizer,
    )

    class MeshcatPointCloudVisualizerCpp(MeshcatPointCloudVisualizer):
        """Retired: use `MeshcatPointCloudVisualizer`."""

        def __init__(self, *args: Any, **kwargs: Any):
            hint("MeshcatPointCloudVisualizerCpp is retired: use MeshcatPointCloudVisualizer.")
            super().__init__(*args, **kwargs)

    class MeshcatVisualizerCpp(MeshcatVisualizer):
        """Retired: use `MeshcatVisualizer`."""

        @staticmethod
        def AddToBuilder(*args: Any, **kwargs: Any) -> Any:
            """Retired: use `MeshcatVisualizer.AddToBuilder`."""
            hint("MeshcatVisualizerCpp is retired: use MeshcatVisualizer.")
            return MeshcatVisualizer.AddToBuilder(*args, **kwargs)

    return {
        "MeshcatPointCloudVisualizerCpp": MeshcatPointCloudVisualizerCpp,
        "MeshcatVisualizerCpp": MeshcatVisualizerCpp,
        **_cameras(),
        **_surface_meshes(),
        "ConnectDrakeVisualizer": forwarded(
            DrakeVisualizer.AddToBuilder, "ConnectDrakeVisualizer", "DrakeVisualizer.AddToBuilder()"
        ),
        "AddSoftHydroelasticProperties": forwarded(AddCompliantHydroelasticProperties, "AddSoftHydroelasticProperties"),
        "AddSoftHydroelasticPropertiesForHalfSpace": forwarded(
            AddCompliantHydroelasticPropertiesForHalfSpace, "AddSoftHydroelasticPropertiesForHalfSpace"
        ),
    }


def _surface_meshes() -> dict[str, Any]:
    import numpy as np

    from sheldrake.geometry import ReadObjToTriangleSurfaceMesh, SurfaceTriangle, TriangleSurfaceMesh

    class SurfaceVertex(np.ndarray):
        """Retired: vertices are positions. The position r_MV [m] of a vertex in the mesh's frame, shape (3,)."""

        def __new__(cls, r_MV: Any) -> SurfaceVertex:
            hint("SurfaceVertex is retired: a vertex of a TriangleSurfaceMesh is its position.")
            return np.asarray(r_MV, dtype=float).reshape(3).view(cls)

        def r_MV(self) -> np.ndarray:
            """The position [m], shape (3,)."""
            return np.array(self)

    read = forwarded(ReadObjToTriangleSurfaceMesh, "ReadObjToSurfaceMesh")
    return {
        "ReadObjToSurfaceMesh": read,
        "SurfaceFace": SurfaceTriangle,
        "SurfaceMesh": TriangleSurfaceMesh,
        "SurfaceVertex": SurfaceVertex,
    }


def _cameras() -> dict[str, Any]:
    from sheldrake.geometry import ClippingRange, ColorRenderCamera, DepthRange, DepthRenderCamera, RenderCameraCore
    from sheldrake.geometry._camera_info import CameraInfo
    from sheldrake.math import RigidTransform

    def core(width: int, height: int, fov_y: float, renderer_name: str, near: float, far: float) -> RenderCameraCore:
        lens, clipping = CameraInfo(width, height, fov_y), ClippingRange(near, far)
        return RenderCameraCore(renderer_name, lens, clipping, RigidTransform())

    def CameraProperties(width: int, height: int, fov_y: float, renderer_name: str) -> ColorRenderCamera:
        """Retired: use `ColorRenderCamera`. A colour camera that sees from 1 cm to 10 m."""
        hint("CameraProperties() is retired: use ColorRenderCamera().")
        return ColorRenderCamera(core(width, height, fov_y, renderer_name, 0.01, 10.0), False)

    def DepthCameraProperties(
        width: int, height: int, fov_y: float, renderer_name: str, z_near: float, z_far: float
    ) -> DepthRenderCamera:
        """Retired: use `DepthRenderCamera`. A depth camera that measures from z_near to z_far [m]."""
        hint("DepthCameraProperties() is retired: use DepthRenderCamera().")
        seen = core(width, height, fov_y, renderer_name, 0.01, max(10.0, z_far))
        return DepthRenderCamera(seen, DepthRange(z_near, z_far))

    return {"CameraProperties": CameraProperties, "DepthCameraProperties": DepthCameraProperties}


def _inverse_kinematics() -> dict[str, Any]:
    from sheldrake.multibody.inverse_kinematics import MinimumDistanceLowerBoundConstraint

    class MinimumDistanceConstraint(MinimumDistanceLowerBoundConstraint):
        """Retired: use `MinimumDistanceLowerBoundConstraint`.

        Args:
            plant: The plant.
            minimum_distance: Least signed distance [m].
            plant_context: Its context.
            penalty_function: See there.
            influence_distance_offset: Pairs farther from each other than both together do not count [m].
        """

        def __init__(
            self,
            plant: MultibodyPlant,
            minimum_distance: float,
            plant_context: Context,
            penalty_function: Any = None,
            influence_distance_offset: float = 1.0,
        ):
            hint("MinimumDistanceConstraint is retired: use MinimumDistanceLowerBoundConstraint.")
            super().__init__(plant, minimum_distance, plant_context, penalty_function, influence_distance_offset)

    return {"MinimumDistanceConstraint": MinimumDistanceConstraint}


def _parsing() -> dict[str, Any]:
    def GetScopedFrameName(plant: MultibodyPlant, frame: Frame) -> str:
        """Retired: use `Frame.scoped_name().get_full()`."""
        hint("GetScopedFrameName() is retired: use frame.scoped_name().get_full().")
        return frame.scoped_name().get_full()

    return {"GetScopedFrameName": GetScopedFrameName}


def _lcm() -> dict[str, Any]:
    from sheldrake.lcm import DrakeLcm

    class DrakeMockLcm(DrakeLcm):
        """Retired: use `DrakeLcm("memq://")`."""

        def __init__(self) -> None:
            hint('DrakeMockLcm is retired: use DrakeLcm("memq://").')
            super().__init__("memq://")

    return {"DrakeMockLcm": DrakeMockLcm}


def _sets() -> dict[str, Any]:
    from sheldrake.geometry.optimization import ComputePairwiseIntersections, IrisNp

    def CalcPairwiseIntersections(*args: Any, **kwargs: Any) -> list[tuple[int, int, np.ndarray]]:
        """Retired: use `ComputePairwiseIntersections`. Pairs that meet, each with its offset."""
        hint("CalcPairwiseIntersections() is retired: use ComputePairwiseIntersections().")
        pairs, offsets = ComputePairwiseIntersections(*args, **kwargs)
        return [(*pair, offset) for pair, offset in zip(pairs, offsets)]

    return {
        "CalcPairwiseIntersections": CalcPairwiseIntersections,
        "IrisInConfigurationSpace": forwarded(IrisNp, "IrisInConfigurationSpace"),
    }


def _plant() -> dict[str, Any]:
    from sheldrake.multibody.meshcat import ContactVisualizer, ContactVisualizerParams

    return {"ContactResultsToMeshcat": ContactVisualizer, "ContactResultsToMeshcatParams": ContactVisualizerParams}


def _tree() -> dict[str, Any]:
    from sheldrake.multibody import tree

    return {"BodyFrame_": tree.RigidBodyFrame_}


def _solvers() -> dict[str, Any]:
    from sheldrake import solvers

    class MinimumValueConstraint(solvers.MinimumValueLowerBoundConstraint):
        """Retired: use `MinimumValueLowerBoundConstraint`."""

        def __init__(self, num_vars: int, minimum_value: float, *args: Any, **kwargs: Any):
            hint("MinimumValueConstraint is retired: use MinimumValueLowerBoundConstraint.")
            super().__init__(num_vars, minimum_value, *args, **kwargs)

    for retired, today in (
        ("kUnknownError", "kSolverSpecificError"),
        ("kInfeasible_Or_Unbounded", "kInfeasibleOrUnbounded"),
    ):
        setattr(solvers.SolutionResult, retired, solvers.SolutionResult[today])
    return {
        "MinimumValueConstraint": MinimumValueConstraint,
        "MobyLCPSolver": solvers.MobyLcpSolver,
        "NonsmoothAugmentedLagrangian": solvers.AugmentedLagrangianNonsmooth,
    }


def _primitives() -> dict[str, Any]:
    import numpy as np

    from sheldrake.systems.framework import LeafSystem

    class SignalLogger(LeafSystem):
        """Retired: use `VectorLogSink`. Keeps what it logs itself, whatever the context.

        Args:
            input_size: Size of the signal.
            batch_allocation_size: Of no effect.
        """

        def __init__(self, input_size: int, batch_allocation_size: int = 1000):
            LeafSystem.__init__(self)
            hint("SignalLogger is retired: use VectorLogSink, and FindLog(context) to read its log.")
            self._size, self._when, self._period = input_size, "step", None
            self.reset()
            self.DeclareVectorInputPort("data", input_size)
            self.DeclarePerStepPublishEvent(lambda context: self._log(context, "step"))
            self.DeclareForcedPublishEvent(lambda context: self._log(context, "forced", "step", "period"))

        def _log(self, context: Context, *modes: str) -> None:
            if self._when in modes:
                self._times.append(context.get_time())
                self._columns.append(np.array(self.get_input_port(0).Eval(context)))

        def set_publish_period(self, period: float) -> None:
            """Logs at every multiple of `period` [s] instead of at every step."""
            self._when = "period"
            self.DeclarePeriodicPublishEvent(period, 0.0, lambda context: self._log(context, "period"))

        def set_forced_publish_only(self) -> None:
            """Logs only when a publish is forced."""
            self._when = "forced"

        def sample_times(self) -> np.ndarray:
            """Returns the times [s], shape `(n,)`."""
            return np.array(self._times)

        def data(self) -> np.ndarray:
            """Returns the samples as columns, shape `(input_size, n)`."""
            return np.array(self._columns).reshape(-1, self._size).T

        def reset(self) -> None:
            """Forgets all samples."""
            self._times: list[float] = []
            self._columns: list[Any] = []

    def LogOutput(src: OutputPort, builder: DiagramBuilder) -> Any:
        """Retired: use `LogVectorOutput`, and `FindLog(context)` to read the log."""
        hint("LogOutput() is retired: use LogVectorOutput(src, builder), and FindLog(context) to read the log.")
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            logger = builder.AddSystem(SignalLogger(src.size()))
        builder.Connect(src, logger.get_input_port(0))
        return logger

    return {"SignalLogger": SignalLogger, "LogOutput": LogOutput}


def _common() -> dict[str, Any]:
    import pathlib

    from sheldrake.common import FindResourceOrThrow

    def set_assertion_failure_to_throw_exception() -> None:
        """Retired: an assertion that fails is an error anyway."""
        hint("set_assertion_failure_to_throw_exception() is retired: it is always so.")

    searched: list[str] = []

    def AddResourceSearchPath(search_path: str) -> None:
        """Retired: set `DRAKE_RESOURCE_ROOT`. A folder that FindResource() looks in, too; it holds `drake/`."""
        hint("AddResourceSearchPath() is retired: set DRAKE_RESOURCE_ROOT, or use PackageMap.Add().")
        searched.append(str(search_path))

    def GetResourceSearchPaths() -> list[str]:
        """Retired: see `AddResourceSearchPath`."""
        return list(searched)

    class FindResourceResult:
        """Retired: use `FindResourceOrThrow`. What FindResource() found."""

        def __init__(self, resource_path: str):
            self._resource_path, self._found, self._error = resource_path, "", ""
            try:
                self._found = find(resource_path)
            except RuntimeError as error:
                self._error = str(error)

        def get_resource_path(self) -> str:
            """What was asked for."""
            return self._resource_path

        def get_absolute_path_or_throw(self) -> str:
            """Where it is; RuntimeError when it is nowhere."""
            if self._error:
                raise RuntimeError(self._error)
            return self._found

        def get_error_message(self) -> str | None:
            """Why nothing was found, or None."""
            return self._error or None

    def find(resource_path: str) -> str:
        own = (pathlib.Path(folder) / resource_path for folder in searched)
        return next((str(path) for path in own if path.is_file()), None) or FindResourceOrThrow(resource_path)

    def FindResource(resource_path: str) -> FindResourceResult:
        """Retired: use `FindResourceOrThrow`."""
        hint("FindResource() is retired: use FindResourceOrThrow().")
        return FindResourceResult(resource_path)

    return {
        "set_assertion_failure_to_throw_exception": set_assertion_failure_to_throw_exception,
        "AddResourceSearchPath": AddResourceSearchPath,
        "GetResourceSearchPaths": GetResourceSearchPaths,
        "FindResource": FindResource,
    }


def _framework() -> dict[str, Any]:
    def GenerateHtml(system: System, initial_depth: int = 1) -> str:
        """Retired: use `GetGraphvizString`. Returns a system and its subsystems as HTML that unfolds.

        Args:
            system: The system.
            initial_depth: How many levels are unfolded at first.
        """
        hint("GenerateHtml() is retired: use System.GetGraphvizString().")
        return _html_of(system, initial_depth)

    from sheldrake.common.value import AbstractValue, Value

    return {"GenerateHtml": GenerateHtml, "AbstractValue": AbstractValue, "Value": Value}


def _html_of(system: Any, depth: int) -> str:
    from html import escape

    ports = [
        f"<li>{kind} <code>{escape(port.get_name())}</code></li>"
        for kind, number, get in (
            ("input", system.num_input_ports(), system.get_input_port),
            ("output", system.num_output_ports(), system.get_output_port),
        )
        for port in (get(i) for i in range(number))
    ]
    inside = ""
    if hasattr(system, "GetSystems"):
        inside = "".join(_html_of(child, depth - 1) for child in system.GetSystems())
        for (to, i), (source, j) in system.connection_map().items():
            a = f"{source.get_name()}.{source.get_output_port(j).get_name()}"
            b = f"{to.get_name()}.{to.get_input_port(i).get_name()}"
            ports.append(f"<li><code>{escape(a)}</code> → <code>{escape(b)}</code></li>")
    name = escape(system.get_name() or type(system).__name__)
    unfolded = " open" if depth > 0 else ""
    style = "margin-left:1em;border-left:1px solid #ccc;padding-left:.5em"
    return f'<details{unfolded} style="{style}"><summary>{name}</summary><ul>{"".join(ports)}</ul>{inside}</details>'


def _rendering() -> dict[str, Any]:
    from . import poses

    return {name: getattr(poses, name) for name in poses.__all__}


FUNCTIONS: dict[str, Callable[[], dict[str, Any]]] = {
    "sheldrake.autodiffutils": _autodiffutils,
    "sheldrake.common": _common,
    "sheldrake.geometry": _geometry,
    "sheldrake.geometry.optimization": _sets,
    "sheldrake.lcm": _lcm,
    "sheldrake.multibody.inverse_kinematics": _inverse_kinematics,
    "sheldrake.multibody.parsing": _parsing,
    "sheldrake.multibody.plant": _plant,
    "sheldrake.multibody.tree": _tree,
    "sheldrake.solvers": _solvers,
    "sheldrake.systems.framework": _framework,
    "sheldrake.systems.primitives": _primitives,
    "sheldrake.systems.rendering": _rendering,
    "sheldrake.visualization": _visualization,
}
"""Retired functions and classes of a module, made when the module is there."""
