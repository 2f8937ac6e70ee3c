"""ModelVisualizer: shows model files in the page, with a slider for each joint."""

from __future__ import annotations

import logging
import os
import time
import warnings
import webbrowser
from collections.abc import Callable
from typing import TYPE_CHECKING, Any

import numpy as np

from sheldrake.common._ctrl_c import deferred_ctrl_c
from sheldrake.common.deprecation import DrakeDeprecationWarning
from sheldrake.geometry import Box, Meshcat, MeshcatCone, Rgba, Role, SceneGraphConfig
from sheldrake.math import RigidTransform, RotationMatrix
from sheldrake.multibody.meshcat._mouse_spring import DEFAULT_STIFFNESS
from sheldrake.multibody.parsing import PackageMap, Parser
from sheldrake.multibody.plant import AddMultibodyPlant, MultibodyPlantConfig
from sheldrake.multibody.tree import BodyIndex, FrameIndex
from sheldrake.systems.analysis import Simulator
from sheldrake.systems.framework import DiagramBuilder

from ._camera_preview import CameraPreview
from ._config import ApplyVisualizationConfig, VisualizationConfig
from ._playback import GROUND, PLAY_BUTTON, PLAY_KEY, RESET_BUTTON, Playback, add_ground
from ._posture_sliders import PostureSliders
from ._triad import AddFrameTriadIllustration

if TYPE_CHECKING:
    from numpy.typing import ArrayLike

    from sheldrake.multibody.plant._multibody_plant import MultibodyPlant

log = logging.getLogger("drake")

_STOP_BUTTON, _RELOAD_BUTTON = "Stop Running", "Reload Model Files"
_HOME_BUTTON, _RANDOM_BUTTON, _WELD_BUTTON = "Home", "Random Posture", "Weld / Free Base"
_WRONG = "/PARSE_ERROR"  # where a traffic cone stands when files cannot be read
_POLL = 1 / 32.0  # time between two looks at the page's controls [s]


def _hint(retired: str, today: str) -> None:
    text = f"ModelVisualizer.{retired}() is retired: use {today}()."
    warnings.warn(text, DrakeDeprecationWarning, stacklevel=3)


class ModelVisualizer:
    """Shows models in the page: looks, collisions, inertias, contacts, and sliders for the posture.

    There is a slider for each position of a joint, and six for a body that floats: its place and its roll, pitch and
    yaw. A model that floats stands on the ground at z = 0, unless its file places it. Where models can be played, a
    button welds what floats where it is, and frees it again.

        visualizer = ModelVisualizer()
        visualizer.AddModels("robot.urdf")
        visualizer.Run()

    Args:
        visualize_frames: Whether frames are drawn as axes.
        triad_length: Length of those axes [m].
        triad_radius: Radius of those axes [m].
        triad_opacity: Opacity of those axes, in [0, 1].
        publish_contacts: Whether contact forces are drawn.
        show_rgbd_sensor: Whether the page's panel shows what a camera that stands where the page's does would see.
        browser_new: Whether Run() opens the page in a browser.
        pyplot: Whether the models are drawn in a matplotlib figure, too.
        meshcat: Where to draw; a new one when left out.
        environment_map: An image for reflections.
        no_lights: Whether the page's lights are switched off.
        compliance_type: How geometries collide that do not say: "undefined", "rigid" or "compliant".
        weld_base: Whether models that float are welded to the world where they stand.
        simulate: Whether the page has buttons to play, pause and reset: models then move under gravity, on ground at
            z = 0 where something floats, and are pulled by the mouse (Ctrl and the left button). Until "play" is
            pressed nothing of that is computed.
    """

    def __init__(
        self,
        *,
        visualize_frames: bool = False,
        triad_length: float = 0.3,
        triad_radius: float = 0.005,
        triad_opacity: float = 0.9,
        publish_contacts: bool = True,
        show_rgbd_sensor: bool = False,
        browser_new: bool = False,
        pyplot: bool = False,
        meshcat: Meshcat | None = None,
        environment_map: str | os.PathLike | None = None,
        no_lights: bool = False,
        compliance_type: str = "undefined",
        weld_base: bool = False,
        simulate: bool = False,
    ):
        self._visualize_frames = visualize_frames
        self._triad: dict[str, Any] = {"length": triad_length, "radius": triad_radius, "opacity": triad_opacity}
        self._publish_contacts, self._pyplot, self._browser_new = publish_contacts, pyplot, browser_new
        self._show_rgbd_sensor = show_rgbd_sensor
        self._preview: CameraPreview | None = None
        self._meshcat, self._no_lights, self._compliance_type = meshcat, no_lights, compliance_type
        self._weld_base, self._simulate = weld_base, simulate
        self._playback: Playback | None = None
        self._random = np.random.default_rng()
        self._environment_map = os.fspath(environment_map or "")
        # What AddModels() was asked for, in order; None once parser() was given away.
        self._added: list[dict[str, Any]] | None = []
        self._diagram: Any = None
        self._changes = 0  # of the sliders
        self._shown: dict[str, float] | None = None  # where the sliders stood at the last look
        self._resumes = False  # whether "play" goes on with a motion that was paused
        self._holds = False  # whether what floats stays where it is
        self._builder, self._plant, self._scene_graph, self._parser = self._new_parser()

    # ---- before Finalize()

    def package_map(self) -> PackageMap:
        """Returns the package map of the parser, to add packages to.

        Raises:
            ValueError: after Finalize().
        """
        self._require_open("package_map")
        return self._parser.package_map()

    def parser(self) -> Parser:
        """Returns the parser, to do what AddModels() cannot; the page then has no button to reload.

        Raises:
            ValueError: after Finalize().
        """
        self._require_open("parser")
        self._added = None
        return self._parser

    def meshcat(self) -> Meshcat:
        """Returns where it draws."""
        if self._meshcat is None:
            self._meshcat = Meshcat()
        return self._meshcat

    def AddModels(self, filename: str | os.PathLike | None = None, *, url: str | None = None) -> None:
        """Adds all models of a file; may be called several times.

        Args:
            filename: The file: URDF, SDFormat, MJCF, model directives, a mesh; or a "package://" address.
            url: A "package://" address, in place of the file.

        Raises:
            RuntimeError: when the file cannot be read.
            ValueError: when not exactly one of both is given, or after Finalize().
        """
        if (filename is None) == (url is None):
            raise ValueError("ModelVisualizer.AddModels(): Must provide either filename= or url=")
        self._require_open("AddModels")
        name = url if filename is None else os.fspath(filename)
        wanted = {"url" if url is not None or str(name).startswith("package://") else "file_name": name}
        self._parser.AddModels(**wanted)
        if self._added is not None:
            self._added.append(wanted)

    def AddModelFromFile(self, filename: str | os.PathLike) -> None:
        """The retired name of AddModels()."""
        _hint("AddModelFromFile", "AddModels")
        self.AddModels(filename)

    def Finalize(self, position: ArrayLike | None = None) -> None:
        """Ends adding models and shows them.

        Args:
            position: Positions of all models [m or rad], shape (nq,); the models' own when left out.

        Raises:
            ValueError: when the size is not nq, or Finalize() was called before.
        """
        self._require_open("Finalize")
        self._finalize(self._plant)
        self._check_size(position)
        self.meshcat().DeleteAddedControls()
        self._show(position)

    # ---- then

    def Run(self, position: ArrayLike | None = None, loop_once: bool = False) -> None:
        """Follows the page's sliders until "Stop Running" or Escape is pressed there; Finalizes first where needed.

        Args:
            position: Positions to begin with [m or rad], shape (nq,).
            loop_once: Whether to show the models once and return.

        Raises:
            KeyboardInterrupt: on Ctrl-C.
            ValueError: when the size is not nq.
        """
        if self._diagram is None:
            self.Finalize(position)
        elif position is not None:
            self._check_size(position)
            self._sliders.SetPositions(position)
        meshcat = self.meshcat()
        if self._browser_new:
            self._browser_new = False
            webbrowser.open(meshcat.web_url())
        with deferred_ctrl_c() as check:
            meshcat.AddButton(_STOP_BUTTON, "Escape")
            for name in (_HOME_BUTTON, _RANDOM_BUTTON) if self._plant.num_positions() else ():
                meshcat.AddButton(name)
            if self._playback is not None:
                if self._plant.GetFloatingBaseBodies():
                    meshcat.AddButton(_WELD_BUTTON)
                self._playback.add_buttons()
            if not loop_once:
                print(
                    f"Look at {meshcat.web_url()}; '{_STOP_BUTTON}' or Escape in the page, or Ctrl-C here, ends it.",
                    flush=True,
                )
                if self._playback is not None:
                    print(f"After '{PLAY_BUTTON}', Ctrl and the left mouse button pull bodies.", flush=True)
            try:
                self._follow(lambda: check() or loop_once or meshcat.GetButtonClicks(_STOP_BUTTON) > 0)
            finally:
                self._pause()
                postures = _HOME_BUTTON, _RANDOM_BUTTON, _WELD_BUTTON
                for name in (_STOP_BUTTON, *postures, PLAY_BUTTON, RESET_BUTTON):
                    meshcat.DeleteButton(name, strict=False)
                if self._added is not None:
                    meshcat.DeleteButton(_RELOAD_BUTTON, strict=False)

    def RunWithReload(self, position: ArrayLike | None = None, loop_once: bool = False) -> None:
        """The retired name of Run()."""
        _hint("RunWithReload", "Run")
        self.Run(position, loop_once)

    def _follow(self, done: Callable[[], bool]) -> None:
        """Publishes whenever a slider has moved, and reloads when asked to."""
        meshcat, answered = self.meshcat(), 0
        self._shown = None
        self._offer_reload()
        while True:
            clicks = meshcat.GetButtonClicks(_RELOAD_BUTTON) if self._added is not None else 0
            if clicks > answered:  # a click during the reload means files changed since: reload once more
                answered, self._shown = clicks, None
                self._reload()
            self._answer_postures()
            self._answer_playback()
            values = self._get_slider_values()
            if values != self._shown:
                self._follow_sliders(self._shown, values)
                self._shown = values
                self._changes += 1
            if self._preview is not None:
                self._preview.look(self._context, self._changes)
            if done():
                return
            time.sleep(_POLL)

    def _clicked(self, name: str, keycode: str = "") -> bool:
        """Whether a button was pressed since this was asked last."""
        meshcat = self.meshcat()
        if name not in meshcat.GetButtonNames() or not meshcat.GetButtonClicks(name):
            return False
        meshcat.AddButton(name, keycode)  # counts anew
        return True

    def _answer_postures(self) -> None:
        """Does what the buttons for postures ask."""
        if self._clicked(_HOME_BUTTON):
            self._sliders.GoHome()
        if self._clicked(_RANDOM_BUTTON):
            self._sliders.GoAnywhere(self._random)
        if self._clicked(_WELD_BUTTON):
            self._holds = not self._holds
            self._hold_or_free()
            text = "It stays where its sliders put it." if self._holds else "It falls when the model plays."
            self.meshcat()._hub.notify("The base is welded" if self._holds else "The base is free", text)

    def _hold_or_free(self) -> None:
        """Locks what floats where it is, or unlocks it."""
        for body in map(self._plant.get_body, self._plant.GetFloatingBaseBodies()):
            if self._holds:
                body.Lock(self._plant_context)
            else:
                body.Unlock(self._plant_context)

    def _answer_playback(self) -> None:
        """Does what the buttons to play, pause and reset ask, and simulates while it plays."""
        playback = self._playback
        if playback is None:
            return
        try:
            if self._clicked(RESET_BUTTON):
                self._reset()
            if self._clicked(PLAY_BUTTON, PLAY_KEY):
                if playback.is_playing:
                    self._pause()
                else:
                    playback.play(None if self._resumes else self._sliders.positions())
            if playback.is_playing:
                playback.advance()
        except RuntimeError as error:
            log.error("ModelVisualizer: the models cannot be simulated: %s", error)
            self.meshcat()._hub.notify("The models cannot be simulated", str(error))
            self._reset()

    def _pause(self) -> None:
        """Stops the motion, if there is one; the sliders then stand for where it stopped."""
        if self._playback is not None and self._playback.is_playing:
            self._carry(self._playback.pause())
            self._resumes = True

    def _reset(self) -> None:
        """Goes back to where the motion began."""
        if self._playback is not None:
            start = self._playback.reset()
            self._resumes = False
            if start is not None:
                self._carry(start)

    def _carry(self, q: np.ndarray) -> None:
        """Shows the models where they are, at positions q, and moves the sliders there."""
        self._sliders.SetPositions(q)
        self._shown = self._get_slider_values()
        self._diagram.ForcedPublish(self._context)

    def _follow_sliders(self, before: dict[str, float] | None, after: dict[str, float]) -> None:
        """Shows what the sliders stand for; while it plays, those that were moved take their joints along."""
        moved = self._sliders.names() if before is None else {n for n, v in after.items() if before.get(n) != v}
        moved &= self._sliders.names()
        if self._playback is not None and self._playback.is_playing:
            self._sliders.MoveJoints(self._plant, self._plant_context, moved)
        elif moved or before is None:
            self._resumes = False
            self._publish()
        else:  # how opaque things are
            self._diagram.ForcedPublish(self._context)

    # ---- how

    def _finalize(self, plant: MultibodyPlant) -> None:
        """Finalizes a plant, its free bodies welded to the world if that is wanted, else above ground."""
        held = {plant.get_joint(j).child_body().index() for j in plant.GetJointIndices()}
        floating = [i for i in map(BodyIndex, range(1, plant.num_bodies())) if i not in held]
        for body in map(plant.get_body, floating if self._weld_base else ()):
            plant.WeldFrames(plant.world_frame(), body.body_frame(), plant.GetDefaultFloatingBaseBodyPose(body))
        if self._simulate and floating and not self._weld_base:
            add_ground(plant)
        plant.Finalize()

    def _require_open(self, call: str) -> None:
        if self._diagram is not None:
            raise ValueError(f"ModelVisualizer.{call}(): Finalize has already been called.")

    def _check_size(self, position: Any) -> None:
        count = self._plant.num_positions()
        if position is not None and len(position) != count:
            raise ValueError(
                f"ModelVisualizer: Number of passed positions ({len(position)}) does not match the number in the "
                f"model ({count})."
            )

    def _new_parser(self) -> tuple[Any, Any, Any, Parser]:
        builder = DiagramBuilder()
        # Ports that are not sampled: contact forces follow the sliders, though time stands still.
        config = MultibodyPlantConfig(time_step=1e-3, use_sampled_output_ports=False)
        scene_config = SceneGraphConfig()
        scene_config.default_proximity_properties.compliance_type = self._compliance_type
        plant, scene_graph = AddMultibodyPlant(config, scene_config, builder)
        parser = Parser(builder=builder)
        parser.SetAutoRenaming(True)
        return builder, plant, scene_graph, parser

    def _show(self, position: ArrayLike | None) -> None:
        """Draws the finalized plant in place of everything the page showed before."""
        meshcat = self.meshcat()
        meshcat.Delete()
        for name in meshcat.GetSliderNames():
            meshcat.DeleteSlider(name)
        if self._environment_map not in ("", "."):
            meshcat.SetEnvironmentMap(self._environment_map)
        if self._no_lights:
            meshcat.SetProperty("/Lights", "visible", False)
        if self._visualize_frames or self._is_bare():
            for index in map(FrameIndex, range(self._plant.num_frames())):
                frame = self._plant.get_frame(index)
                if frame is not self._plant.world_frame():
                    AddFrameTriadIllustration(scene_graph=self._scene_graph, frame=frame, **self._triad)
        config = VisualizationConfig(publish_contacts=self._publish_contacts, enable_alpha_sliders=True)
        if self._simulate:
            config.mouse_interaction_stiffness = DEFAULT_STIFFNESS
        ApplyVisualizationConfig(config, self._builder, meshcat=meshcat)
        if self._pyplot:
            from sheldrake.systems.planar_scenegraph_visualizer import ConnectPlanarSceneGraphVisualizer

            ConnectPlanarSceneGraphVisualizer(self._builder, self._scene_graph)
        if self._show_rgbd_sensor:
            if self._preview is not None:
                self._preview.delete()
            self._preview = CameraPreview(meshcat, self._builder, self._scene_graph)
        self._sliders = PostureSliders(meshcat, self._plant, position)
        self._offer_reload()
        self._diagram = self._builder.Build()
        self._context = self._diagram.CreateDefaultContext()
        self._plant_context = self._plant.GetMyMutableContextFromRoot(self._context)
        self._apply_positions()
        if self._holds:
            self._hold_or_free()
        Simulator(self._diagram, self._context).Initialize()
        self._resumes = False
        if self._simulate:
            spring: Any = self._diagram.GetSubsystemByName("meshcat_mouse_spring")
            self._playback = Playback(meshcat, self._diagram, self._context, self._plant, self._scene_graph, spring)
        self._show_collisions_where_nothing_else_is()
        if position is None:
            self._stand()

    def _is_bare(self) -> bool:
        """Whether the models have bodies but nothing to see: what is left to show are their frames."""
        inspector = self._scene_graph.model_inspector()
        shown = inspector.num_geometries() - sum(
            inspector.GetName(g).endswith(GROUND) for g in inspector.GetAllGeometryIds(Role.kProximity)
        )
        if shown or self._plant.num_bodies() == 1:
            return False
        log.warning("ModelVisualizer: no body has geometry; frames are drawn in its place.")
        return True

    def _show_collisions_where_nothing_else_is(self) -> None:
        """A model without looks is seen by what collides."""
        inspector = self._scene_graph.model_inspector()
        looks = [g for g in inspector.GetAllGeometryIds(Role.kIllustration) if not self._is_ours(inspector, g)]
        if not looks and inspector.NumGeometriesWithRole(Role.kProximity):
            self.meshcat().SetProperty("proximity", "visible", True)

    @staticmethod
    def _is_ours(inspector: Any, geometry: Any) -> bool:
        """Whether a geometry is a note of ours: an ellipsoid that shows an inertia."""
        return inspector.GetIllustrationProperties(geometry).HasProperty("meshcat", "accepting")

    def _stand(self) -> None:
        """Places every model that floats, and whose file does not say where, on the ground."""
        for index in self._plant.GetFloatingBaseBodies():
            body = self._plant.get_body(index)
            if body.has_quaternion_dofs() and self._plant.GetDefaultFloatingBaseBodyPose(body).IsExactlyIdentity():
                lowest = self._lowest(self._plant.GetModelInstanceName(body.model_instance()))
                if lowest is not None:
                    self._sliders.Lift(body, -lowest)
        self._publish()

    def _lowest(self, model: str) -> float | None:
        """The height of the lowest point that is seen of a model [m], None where nothing is."""
        path = model.replace("::", "/")
        heights = (self.meshcat()._lowest(f"{prefix}/{path}") for prefix in ("illustration", "proximity"))
        return next((height for height in heights if height is not None), None)

    def _offer_reload(self) -> None:
        """Shows the button to reload. Adding it twice would forget its clicks."""
        meshcat = self.meshcat()
        if self._added is not None and _RELOAD_BUTTON not in meshcat.GetButtonNames():
            meshcat.AddButton(_RELOAD_BUTTON)

    def _apply_positions(self) -> None:
        self._plant.SetPositions(self._plant_context, self._sliders.positions())

    def _publish(self) -> None:
        self._apply_positions()
        self._diagram.ForcedPublish(self._context)

    def _reload(self) -> None:
        """Reads the files again; the sliders stay where they are. A file that cannot be read adds a traffic cone."""
        given, values = self._parser.package_map(), self._get_slider_values()
        try:
            made = self._new_parser()
            plant, parser = made[1], made[3]
            parser.package_map().AddMap(given)
            for wanted in self._added or ():
                parser.AddModels(**wanted)
            self._finalize(plant)
        except Exception as error:
            log.error("ModelVisualizer: the models cannot be reloaded: %s", error)
            log.warning("Click '%s' to try again.", _RELOAD_BUTTON)
            self._add_traffic_cone()
            return
        self.meshcat().Delete(_WRONG)
        self._builder, self._plant, self._scene_graph, self._parser = made
        self._show(None)
        self._set_slider_values(values)
        self._publish()

    def _add_traffic_cone(self) -> None:
        """Shows in the page that what it shows is not what the files say."""
        meshcat, orange = self.meshcat(), Rgba(1.0, 0.33, 0.0)
        meshcat.SetObject(f"{_WRONG}/base", Box(0.3, 0.3, 0.02), orange)
        meshcat.SetTransform(f"{_WRONG}/base", RigidTransform([0.0, 0.0, 0.01]))
        meshcat.SetObject(f"{_WRONG}/cone", MeshcatCone(0.5, 0.12, 0.12), orange)
        # A MeshcatCone stands on its tip.
        meshcat.SetTransform(f"{_WRONG}/cone", RigidTransform(RotationMatrix.MakeXRotation(np.pi), [0.0, 0.0, 0.52]))

    def _get_slider_values(self) -> dict[str, float]:
        """Returns where all sliders of the page stand, by name."""
        meshcat = self.meshcat()
        return {name: meshcat.GetSliderValue(name) for name in meshcat.GetSliderNames()}

    def _set_slider_values(self, values: dict[str, float]) -> None:
        """Moves the sliders of the page that still exist."""
        for name in set(self.meshcat().GetSliderNames()) & values.keys():
            self.meshcat().SetSliderValue(name, values[name])
