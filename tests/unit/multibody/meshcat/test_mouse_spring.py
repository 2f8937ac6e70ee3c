"""MeshcatMouseSpring: what a hand on the mouse does to the bodies of a plant."""

import gc

import numpy as np
import pytest

from sheldrake.all import (
    AddMultibodyPlantSceneGraph,
    Box,
    DiagramBuilder,
    ExternallyAppliedSpatialForceMultiplexer,
    Meshcat,
    MeshcatVisualizer,
    MultibodyPlant,
    RevoluteJoint,
    Rgba,
    RigidTransform,
    RollPitchYaw,
    Simulator,
    SpatialInertia,
)
from sheldrake.common.kernel import Kernel
from sheldrake.multibody.meshcat import MeshcatMouseSpring
from sheldrake.systems.framework._declarations import PythonStage

INERTIA = SpatialInertia.SolidBoxWithMass(2.0, 0.2, 0.3, 0.4)
X_BG = RigidTransform(RollPitchYaw(0.2, 0.1, -0.4), [0.01, -0.02, 0.03])
BOX, ROD = "/drake/visualizer/box/box/box/look", "/drake/visualizer/rod/rod/rod/look"


class JoinedInPython(ExternallyAppliedSpatialForceMultiplexer):
    """A multiplexer that joins lists in Python, whatever feeds it."""

    def _native_forces(self, plant, rows_of, root):
        return None


class Scene:
    """A box that floats and carries a rod on a hinge, without gravity."""

    def __init__(self, time_step=1e-3, as_list=False, stiffness=100.0):
        builder = DiagramBuilder()
        self.plant, scene_graph = plant, _ = AddMultibodyPlantSceneGraph(builder, time_step)
        for name in ("box", "rod"):
            instance = plant.AddModelInstance(name)
            body = plant.AddRigidBody(name, instance, INERTIA)
            plant.RegisterVisualGeometry(body, X_BG, Box(0.2, 0.3, 0.4), "look", np.ones(4))
        box, rod = plant.GetFrameByName("box"), plant.GetFrameByName("rod")
        plant.AddJoint(RevoluteJoint("hinge", box, rod, [0.0, 0.6, 0.8]))
        plant.mutable_gravity_field().set_gravity_vector([0.0, 0.0, 0.0])
        plant.Finalize()
        self.meshcat = Meshcat(port=0)
        MeshcatVisualizer.AddToBuilder(builder, scene_graph, self.meshcat)
        if not as_list:
            self.spring = MeshcatMouseSpring.AddToBuilder(builder, plant, self.meshcat, stiffness)
        else:
            self.spring = spring = builder.AddSystem(MeshcatMouseSpring(self.meshcat, plant, stiffness))
            joined = builder.AddSystem(JoinedInPython(1))
            builder.Connect(plant.get_body_poses_output_port(), spring.get_body_poses_input_port())
            velocities = plant.get_body_spatial_velocities_output_port()
            builder.Connect(velocities, spring.get_body_spatial_velocities_input_port())
            builder.Connect(spring.get_spatial_forces_output_port(), joined.get_input_port(0))
            builder.Connect(joined.get_output_port(), plant.get_applied_spatial_force_input_port())
        self.diagram = builder.Build()
        self.simulator = Simulator(self.diagram)
        self.context = self.simulator.get_mutable_context()
        self.own = plant.GetMyMutableContextFromRoot(self.context)
        self.simulator.Initialize()

    def say(self, client=1, **message):
        self.meshcat._hub.controls.receive({"type": "mouse_drag", **message}, client)

    def pose(self, name="box"):
        return self.plant.EvalBodyPoseInWorld(self.own, self.plant.GetBodyByName(name))

    def kinds(self):
        layout = self.context._store.layout
        place = layout.places[layout.node_of[self.plant._system_id]]
        first = next(r for r in place.events if r >= 0) if self.plant.is_discrete() else place.derivatives
        return {type(layout.rows[r].calc) for r in layout.stages(first)}


@pytest.mark.parametrize("time_step", [0.0, 1e-3])
def test_the_step_stays_machine_code_and_pulls_as_the_list_of_forces_does(time_step):
    found = []
    for as_list in (False, True):
        scene = Scene(time_step, as_list)
        assert scene.kinds() == ({PythonStage, Kernel} if as_list else {Kernel})
        scene.plant.SetVelocities(scene.own, np.linspace(-1.0, 1.0, 7))
        scene.say(name=ROD, point=[0.05, 0.1, -0.1], drag_target=[1.0, 0.5, 0.25])
        scene.simulator.AdvanceTo(0.2)
        found.append(scene.plant.GetPositionsAndVelocities(scene.own))
    assert np.abs(found[0]).max() > 0.1
    np.testing.assert_allclose(found[0], found[1], rtol=1e-9, atol=1e-9)  # round-off of sums in another order


def test_nothing_held_is_no_spring():
    plain, moved = Scene(), Scene()
    moved.say(name=BOX, point=[0, 0, 0], drag_target=[1.0, 0.0, 0.0])
    moved.say(name="", drag_target=[])
    for scene in (plain, moved):
        scene.plant.SetVelocities(scene.own, np.linspace(-1.0, 1.0, 7))
        scene.simulator.AdvanceTo(0.1)
    states = [scene.plant.GetPositionsAndVelocities(scene.own) for scene in (plain, moved)]
    np.testing.assert_array_equal(*states)
    assert moved.spring.get_spatial_forces_output_port().Eval(moved.spring.GetMyContextFromRoot(moved.context)) == []


def test_what_is_pulled_follows_with_half_of_critical_damping_whatever_its_mass():
    """A point mass: the plant's centre of mass, held there; x'' = k (x_T - x) - √k x'."""
    k, scene = 100.0, Scene(0.0)
    scene.simulator.get_mutable_integrator().set_target_accuracy(1e-9)
    plant = scene.plant
    center = plant.CalcCenterOfMassPositionInWorld(scene.own)
    point = X_BG.inverse() @ center
    scene.say(name=BOX, point=point, drag_target=center + np.array([0.3, 0.0, 0.0]))
    t, rate, damped = 0.25, np.sqrt(k) / 2, np.sqrt(k - k / 4)
    scene.simulator.AdvanceTo(t)
    expected = 0.3 * (1 - np.exp(-rate * t) * (np.cos(damped * t) + rate / damped * np.sin(damped * t)))
    moved = plant.CalcCenterOfMassPositionInWorld(scene.own) - center
    assert moved == pytest.approx([expected, 0, 0], abs=1e-7)


def test_it_is_held_where_it_was_taken_though_it_moves_before_the_message_comes():
    scene = Scene()
    scene.plant.SetFreeBodyPose(
        scene.own, scene.plant.GetBodyByName("box"), RigidTransform(RollPitchYaw(0.3, 0.2, 0.1), [1.0, 2.0, 3.0])
    )
    scene.say(name=BOX, point=[0.05, 0.1, -0.1], drag_target=[0.0, 0.0, 0.0])
    body, p_BQ, p_WT = scene.meshcat._grabs.held()
    assert body == "box/box" and p_BQ == pytest.approx(X_BG @ [0.05, 0.1, -0.1]) and p_WT.tolist() == [0, 0, 0]


def test_a_message_of_meshcat_itself_tells_the_point_in_the_world():
    import msgspec

    scene = Scene()
    X_WB = RigidTransform(RollPitchYaw(0.3, 0.2, 0.1), [1.0, 2.0, 3.0])
    scene.plant.SetFreeBodyPose(scene.own, scene.plant.GetBodyByName("box"), X_WB)
    scene.diagram.ForcedPublish(scene.context)
    anchor = X_WB @ [0.05, 0.1, -0.1]
    for target in ([1.0, 2.0, 3.5], [1.0, 2.0, 4.0]):
        message = {"type": "mouse_drag", "name": BOX, "drag_anchor": anchor.tolist(), "drag_target": target}
        scene.meshcat._InjectWebsocketMessage(msgspec.msgpack.encode(message))
        anchor = anchor + 0.1  # it has moved on: the point stays the one that was taken
    body, p_BQ, p_WT = scene.meshcat._grabs.held()
    assert body == "box/box" and p_BQ == pytest.approx([0.05, 0.1, -0.1]) and p_WT.tolist() == [1.0, 2.0, 4.0]


def test_nonsense_moves_nothing_and_a_page_that_goes_lets_go():
    scene = Scene()
    good = {"name": BOX, "point": [0, 0, 0], "drag_target": [1.0, 0.0, 0.0]}
    for bad in (
        {**good, "point": [0, 0]},
        {**good, "drag_target": [0.0, float("nan"), 0.0]},
        {**good, "drag_target": "here"},
        {"name": BOX},
    ):
        with pytest.raises((ValueError, KeyError)):
            scene.say(**bad)
        assert scene.meshcat._grabs.held() is None
    scene.say(**{**good, "name": "/drake/visualizer/unknown"})
    assert scene.spring._hold.body[0] == 0, "only bodies are held"
    scene.say(**good)
    scene.say(client=2, name="", drag_target=[])
    scene.meshcat._grabs.end(2)
    assert scene.spring._hold.body[0] != 0, "another page ends its own drag only"
    scene.meshcat._grabs.end(1)
    assert scene.spring._hold.body[0] == 0


def test_the_longest_name_counts_and_of_equal_ones_the_one_nearest_to_the_root():
    meshcat = Meshcat(port=0)
    meshcat.SetObject("v/arm/rod/arm/rod", Box(1, 1, 1), Rgba(1, 0, 0))
    meshcat.SetTransform("v/arm/rod/arm/rod", RigidTransform([0.0, 0.0, 1.0]))

    class Listener:
        def hear(self):
            pass

    listener = Listener()
    meshcat._grabs.offer(["rod", "arm/rod"], listener.hear)
    message = {"type": "mouse_drag", "name": "/drake/v/arm/rod/arm/rod", "point": [0, 0, 0], "drag_target": [0, 0, 0]}
    meshcat._hub.controls.receive(message, 1)
    body, point, _ = meshcat._grabs.held()
    assert body == "arm/rod" and point.tolist() == [0, 0, 1]


def test_it_is_offered_as_long_as_the_spring_lives_and_is_enabled():
    scene = Scene()
    grabs = scene.meshcat._grabs
    assert grabs.bodies() == ["box/box", "rod/rod"]
    scene.say(name=BOX, point=[0, 0, 0], drag_target=[1.0, 0.0, 0.0])
    scene.spring.Enable(False)
    assert grabs.bodies() == [] and grabs.held() is None and scene.spring._hold.body[0] == 0
    scene.spring.Enable()
    assert grabs.bodies() == ["box/box", "rod/rod"]
    meshcat = scene.meshcat
    del scene
    gc.collect()
    assert meshcat._grabs.bodies() == []


def test_bodies_carry_what_hangs_on_them():
    scene = Scene()
    rod, box = (int(scene.plant.GetBodyByName(name).index()) for name in ("rod", "box"))
    assert scene.spring._masses[rod] == 2.0 and scene.spring._masses[box] == 4.0


def test_what_cannot_be_is_refused():
    meshcat, plant = Meshcat(port=0), MultibodyPlant(0.0)
    with pytest.raises(RuntimeError, match="Finalize"):
        MeshcatMouseSpring(meshcat, plant)
    plant.Finalize()
    with pytest.raises(RuntimeError, match="SceneGraph"):
        MeshcatMouseSpring(meshcat, plant)
    with pytest.raises(RuntimeError, match="stiffness"):
        Scene(stiffness=-1.0)
