import json

import numpy as np
import pytest
from tests.libraries import names_of
from tests.unit.cad import solids

from sheldrake.cad import ConvertModel, WriteModel

TOLERANCE = 1e-12  # relative to the largest entry: rounding of poses through roll, pitch and yaw, a few links deep
LIBRARIES = ["sheldrake", pytest.param("pydrake", marks=pytest.mark.peer)]


def names(name):
    """The names of sheldrake, or of pydrake."""
    multibody = ("multibody.plant", "multibody.parsing", "multibody.tree", "multibody.math")
    return names_of(name, *multibody, "systems.framework", "geometry", "math")


S = names("sheldrake")


def load(lib, *paths):
    """Plant, scene graph, and context with a discrete plant that has all models of the files."""
    builder = lib.DiagramBuilder()
    plant, scene_graph = lib.AddMultibodyPlantSceneGraph(builder, 1e-3)
    for path in paths:
        lib.Parser(plant).AddModels(str(path))
    plant.Finalize()
    return plant, scene_graph, plant.CreateDefaultContext()


def random_states(plant, seed=3, count=20):
    rng = np.random.default_rng(seed)
    for _ in range(count):
        q, v = rng.uniform(-1.0, 1.0, plant.num_positions()), rng.uniform(-1.0, 1.0, plant.num_velocities())
        for index in plant.GetFloatingBaseBodies():
            start = plant.get_body(index).floating_positions_start()
            q[start : start + 4] /= np.linalg.norm(q[start : start + 4])
        yield q, v


def numbers(lib, plant, context, q, v, bodies):
    plant.SetPositions(context, q)
    plant.SetVelocities(context, v)
    forces = lib.MultibodyForces(plant)
    plant.CalcForceElementsContribution(context, forces)
    tau = plant.CalcInverseDynamics(context, np.zeros(plant.num_velocities()), forces)
    poses = [plant.EvalBodyPoseInWorld(context, plant.GetBodyByName(b)).GetAsMatrix34() for b in bodies]
    return {
        "M": plant.CalcMassMatrix(context),
        "bias": plant.CalcBiasTerm(context),
        "tau": tau,
        "poses": np.array(poses),
        "com": plant.CalcCenterOfMassPositionInWorld(context),
    }


def assert_same_dynamics(plant, lib, path, in_order=True):
    other, scene_graph, other_context = load(lib, path)
    context = plant.CreateDefaultContext()
    bodies = [plant.get_body(S.BodyIndex(i)).name() for i in range(1, plant.num_bodies())]
    assert (other.num_positions(), other.num_velocities()) == (plant.num_positions(), plant.num_velocities())
    order_q = [plant.GetPositionNames(False).index(name) for name in other.GetPositionNames(False)]
    order_v = [plant.GetVelocityNames(False).index(name) for name in other.GetVelocityNames(False)]
    if in_order:
        assert order_q == list(range(plant.num_positions()))
    for q, v in random_states(plant):
        expected = numbers(S, plant, context, q, v, bodies)
        found = numbers(lib, other, other_context, q[order_q], v[order_v], bodies)
        for key, value in expected.items():
            if key in ("M", "bias", "tau"):
                value = value[np.ix_(order_v, order_v)] if key == "M" else value[order_v]
            scale = max(1.0, np.abs(value).max())
            np.testing.assert_allclose(found[key], value, rtol=0.0, atol=TOLERANCE * scale, err_msg=key)
    return other, scene_graph


def assert_same_joints(plant, other):
    for index in plant.GetJointIndices():
        joint = plant.get_joint(index)
        if joint.type_name() in ("weld", "quaternion_floating"):
            continue
        twin = other.GetJointByName(joint.name())
        assert twin.type_name() == joint.type_name()
        for what in ("position_lower", "position_upper", "velocity_lower", "velocity_upper", "acceleration_lower",
                     "acceleration_upper"):  # fmt: skip
            np.testing.assert_array_equal(getattr(twin, f"{what}_limits")(), getattr(joint, f"{what}_limits")())
        np.testing.assert_array_equal(twin.default_damping_vector(), joint.default_damping_vector())


def assert_same_actuators(plant, other, names=True):
    indices, others = plant.GetJointActuatorIndices(), other.GetJointActuatorIndices()
    assert len(indices) == len(others)
    for index, other_index in zip(indices, others):
        a, b = plant.get_joint_actuator(index), other.get_joint_actuator(other_index)
        assert a.joint().name() == b.joint().name() and (not names or a.name() == b.name())
        for what in ("effort_limit", "default_rotor_inertia", "default_gear_ratio", "has_controller"):
            assert getattr(a, what)() == getattr(b, what)()
        if a.has_controller():
            assert (a.get_controller_gains().p, a.get_controller_gains().d) == (
                b.get_controller_gains().p,
                b.get_controller_gains().d,
            )


def random_pose(rng):
    return S.RigidTransform(S.RollPitchYaw(rng.uniform(-1.5, 1.5, 3)), rng.uniform(-0.3, 0.3, 3))


def random_inertia(rng):
    mass, sides, p = rng.uniform(0.5, 2.0), rng.uniform(0.1, 0.3, 3), rng.uniform(-0.1, 0.1, 3)
    I_box = S.SpatialInertia.SolidBoxWithMass(mass, *sides)
    return I_box.Shift(-p)


class Robot:
    """A tree with one joint of each kind, made in code."""

    def __init__(self, child_offsets=True, seed=5):
        self.rng = np.random.default_rng(seed)
        self.builder = S.DiagramBuilder()
        self.plant, self.scene_graph = S.AddMultibodyPlantSceneGraph(self.builder, 1e-3)
        self.instance = self.plant.AddModelInstance("robot")
        self.bodies = [self.plant.world_body()]
        self.child_offsets = child_offsets

    def body(self, name=None):
        name = name or f"link{len(self.bodies)}"
        self.bodies.append(self.plant.AddRigidBody(name, self.instance, random_inertia(self.rng)))
        return self.bodies[-1]

    def joint(self, kind, *args, parent=None, name=None, **kwargs):
        parent = parent or self.bodies[-1]
        child = self.body()
        X_CM = random_pose(self.rng) if self.child_offsets else None
        name = name or f"{kind.__name__}_{child.name()}"
        joint = kind(name, *self.frames(name, parent, child, X_CM), *args, **kwargs)
        return self.plant.AddJoint(joint)

    def frames(self, name, parent, child, X_CM):
        frame_F = S.FixedOffsetFrame(f"{name}_parent", parent.body_frame(), random_pose(self.rng), self.instance)
        frame_F = self.plant.AddFrame(frame_F)
        if X_CM is None:
            return frame_F, child.body_frame()
        frame_M = S.FixedOffsetFrame(f"{name}_child", child.body_frame(), X_CM, self.instance)
        return frame_F, self.plant.AddFrame(frame_M)

    def with_all_joints(self, planar=True):
        axis = np.array([1.0, 2.0, -2.0]) / 3.0
        plant = self.plant
        revolute = self.joint(S.RevoluteJoint, axis, -1.0, 2.0, 0.1)
        revolute.set_velocity_limits([-3.0], [3.0])
        revolute.set_acceleration_limits([-30.0], [30.0])
        prismatic = self.joint(S.PrismaticJoint, axis, -0.2, 0.3, 0.2)
        free_turning = self.joint(S.RevoluteJoint, [0, 0, 1], -np.inf, np.inf)
        self.joint(S.WeldJoint, random_pose(self.rng))
        self.joint(S.ScrewJoint, [1.0, 0.0, 0.0], 0.05, 0.3)
        self.joint(S.UniversalJoint, 0.4, parent=self.bodies[2])
        self.joint(S.BallRpyJoint, 0.5)
        if planar:
            self.joint(S.PlanarJoint, np.array([0.1, 0.2, 0.3]), parent=self.bodies[1])
        motor = plant.AddJointActuator("motor", revolute, 10.0)
        motor.set_default_rotor_inertia(0.01)
        motor.set_default_gear_ratio(50.0)
        motor.set_controller_gains(S.PdControllerGains(p=100.0, d=5.0))
        plant.AddJointActuator("PrismaticJoint_link2", prismatic)
        self.joint(S.RevoluteJoint, [0, 1, 0], -0.5, np.inf, 0.0, parent=self.bodies[1], name="finger")
        plant.AddCouplerConstraint(plant.GetJointByName("finger"), free_turning, -0.5, 0.1)
        X = random_pose(self.rng)
        plant.AddFrame(S.FixedOffsetFrame("tool", self.bodies[3].body_frame(), X, self.instance))
        return self

    def with_a_free_body(self):
        free = self.body("free")
        self.plant.SetDefaultFloatingBaseBodyPose(free, random_pose(self.rng))
        return self

    def with_forces(self):
        plant, bodies = self.plant, self.bodies
        plant.AddForceElement(S.LinearSpringDamper(bodies[1], [0.1, 0, 0], bodies[4], [0, 0.2, 0], 0.3, 50.0, 2.0))
        tool = plant.GetFrameByName("tool")
        numbers = np.arange(1.0, 13.0).reshape(4, 3)
        plant.AddForceElement(S.LinearBushingRollPitchYaw(bodies[1].body_frame(), tool, *numbers))
        plant.AddBallConstraint(bodies[2], [0.1, 0.2, 0.3], bodies[5], [0.3, 0.2, 0.1])
        return self

    def done(self):
        self.plant.Finalize()
        return self.plant


@pytest.mark.parametrize("library", LIBRARIES)
@pytest.mark.parametrize("offsets", [False, True])
@pytest.mark.parametrize("format", ["urdf", "sdf"])
def test_every_joint_comes_back(tmp_path, format, offsets, library):
    pytest.importorskip(library)
    lib = names(library)
    plant = Robot(offsets).with_all_joints().with_a_free_body().done()
    written = WriteModel(plant, tmp_path / f"robot.{format}")
    other, _ = assert_same_dynamics(plant, lib, written.path, in_order=format == "urdf")
    assert_same_joints(plant, other)
    assert_same_actuators(plant, other, names=format == "urdf")
    assert other.num_constraints() == 1
    np.testing.assert_allclose(
        other.GetFrameByName("tool").GetFixedPoseInBodyFrame().GetAsMatrix34(),
        plant.GetFrameByName("tool").GetFixedPoseInBodyFrame().GetAsMatrix34(),
        atol=1e-15,
    )
    losses = "\n".join(written.losses)
    if format == "sdf":
        pose = other.GetDefaultFloatingBaseBodyPose(other.GetBodyByName("free")).GetAsMatrix34()
        expected = plant.GetDefaultFloatingBaseBodyPose(plant.GetBodyByName("free")).GetAsMatrix34()
        np.testing.assert_allclose(pose, expected, atol=1e-15)
        assert written.losses == [
            "actuator 'motor' is called like its joint, 'RevoluteJoint_link1'",
            "the place of joint 'PlanarJoint_link8' among the joints: planar ones come last",
        ]
    else:
        assert "default pose of the free link 'free'" in losses
        assert ("was added" in losses) == offsets
        assert len(written.losses) == (8 if offsets else 1), losses


@pytest.mark.parametrize("library", LIBRARIES)
@pytest.mark.parametrize("format", ["urdf", "sdf"])
def test_forces_and_ball_constraints(tmp_path, format, library):
    pytest.importorskip(library)
    plant = Robot(False).with_all_joints().with_forces().done()
    written = WriteModel(plant, tmp_path / f"robot.{format}")
    other, _ = assert_same_dynamics(plant, names(library), written.path, in_order=format == "urdf")
    assert other.num_constraints() == 2


def test_springs(tmp_path):
    robot = Robot(False)
    first = robot.joint(S.RevoluteJoint, [0, 0, 1])
    second = robot.joint(S.PrismaticJoint, [0, 0, 1])
    robot.plant.AddForceElement(S.RevoluteSpring(first, 0.3, 20.0))
    robot.plant.AddForceElement(S.PrismaticSpring(second, 0.1, 30.0))
    plant = robot.done()
    written = WriteModel(plant, tmp_path / "robot.sdf")
    assert not written.losses
    assert_same_dynamics(plant, S, written.path)
    assert any("spring" in loss for loss in WriteModel(plant, tmp_path / "robot.urdf").losses)


@pytest.mark.parametrize("library", LIBRARIES)
@pytest.mark.parametrize("format", ["urdf", "sdf"])
@pytest.mark.filterwarnings("ignore:Hydroelastic contact is not available")
def test_geometry_comes_back(tmp_path, format, library):
    pytest.importorskip(library)
    robot = Robot(False)
    (tmp_path / "mesh.obj").write_bytes(solids.obj(*solids.box(0.1, 0.1, 0.1)))
    mesh = str(tmp_path / "mesh.obj")
    robot.joint(S.RevoluteJoint, [0, 0, 1], parent=robot.plant.world_body())
    link, plant = robot.bodies[-1], robot.plant
    shapes = [S.Box(0.1, 0.2, 0.3), S.Sphere(0.1), S.Cylinder(0.1, 0.2), S.Capsule(0.1, 0.2),
              S.Ellipsoid(0.1, 0.2, 0.3),
              S.Mesh(mesh, [1.0, 2.0, -3.0]), S.Convex(mesh, 0.5)]  # fmt: skip
    for i, shape in enumerate(shapes):
        properties = S.ProximityProperties()
        S.AddContactMaterial(0.5, 1e5 * (i + 1), S.CoulombFriction(0.9, 0.1 * i), properties)
        properties.AddProperty("material", "relaxation_time", 0.1 * i)
        if i == 1:
            S.AddCompliantHydroelasticProperties(0.02, 1e6, properties)
        if i == 2:
            S.AddRigidHydroelasticProperties(0.03, properties)
        plant.RegisterCollisionGeometry(link, random_pose(robot.rng), shape, f"c{i}", properties)
        plant.RegisterVisualGeometry(link, random_pose(robot.rng), shape, f"v{i}", [0.25, 0.5, 0.125 * i, 1.0])
    only_seen = S.GeometryInstance(random_pose(robot.rng), S.Sphere(0.2), "only_seen")
    only_seen.set_illustration_properties(S.IllustrationProperties())
    plant.RegisterVisualGeometry(link, only_seen)
    robot.done()
    written = WriteModel(plant, tmp_path / f"robot.{format}", robot.scene_graph)
    assert written.losses == []
    lib = names(library)
    other, other_graph, _ = load(lib, written.path)
    assert describe(S, plant, robot.scene_graph, link) == describe(
        lib, other, other_graph, other.GetBodyByName("link1")
    )


def describe(lib, plant, scene_graph, body):
    """Everything about the shapes of a body, poses rounded to 1e-12 m."""
    inspector = scene_graph.model_inspector()
    found = {}
    for geometry_id in [*plant.GetVisualGeometriesForBody(body), *plant.GetCollisionGeometriesForBody(body)]:
        shape = inspector.GetShape(geometry_id)
        kind = type(shape).__name__
        if kind in ("Mesh", "Convex"):
            size = [*shape.scale3()]
        else:
            size = [float(x) for x in np.atleast_1d(shape.size())] if kind == "Box" else [
                getattr(shape, m)() for m in ("radius", "length", "a", "b", "c") if hasattr(shape, m)
            ]  # fmt: skip
        proximity = inspector.GetProximityProperties(geometry_id)
        contact = None
        if proximity is not None:
            friction = proximity.GetProperty("material", "coulomb_friction")
            contact = [friction.static_friction(), friction.dynamic_friction()]
            for group, names in (
                ("material", ("relaxation_time", "point_contact_stiffness", "hunt_crossley_dissipation")),
                ("hydroelastic", ("resolution_hint", "hydroelastic_modulus")),
            ):
                contact += [
                    proximity.GetPropertyOrDefault(group, n, None) for n in names if proximity.HasProperty(group, n)
                ]
            contact.append(proximity.HasProperty("hydroelastic", "compliance_type"))
        looks = []
        for role in (inspector.GetIllustrationProperties(geometry_id), inspector.GetPerceptionProperties(geometry_id)):
            if role is not None and role.HasProperty("phong", "diffuse"):
                rgba = role.GetProperty("phong", "diffuse")
                looks.append([rgba.r(), rgba.g(), rgba.b(), rgba.a()])
            else:
                looks.append(role is not None)
        pose = np.round(inspector.GetPoseInFrame(geometry_id).GetAsMatrix34(), 12) + 0.0
        found[inspector.GetName(geometry_id)] = (kind, size, pose.tolist(), str(contact), str(looks))
    return found


@pytest.mark.parametrize("library", LIBRARIES)
@pytest.mark.parametrize("format", ["urdf", "sdf"])
def test_filters_come_back(tmp_path, format, library):
    pytest.importorskip(library)
    robot = Robot(True)
    for _ in range(4):
        robot.joint(S.RevoluteJoint, [0, 0, 1], parent=robot.bodies[-1])
    plant = robot.plant
    friction = S.CoulombFriction(1.0, 1.0)
    ids = [
        plant.RegisterCollisionGeometry(b, S.RigidTransform(), S.Sphere(0.01), "c", friction) for b in robot.bodies[1:]
    ]
    robot.done()
    declaration = S.CollisionFilterDeclaration().ExcludeBetween(S.GeometrySet(ids[0]), S.GeometrySet([ids[2], ids[3]]))
    robot.scene_graph.collision_filter_manager().Apply(declaration)
    written = WriteModel(plant, tmp_path / f"robot.{format}", robot.scene_graph)
    assert not [loss for loss in written.losses if "was added" not in loss]
    other, graph, _ = load(names(library), written.path)
    inspector = graph.model_inspector()
    others = [other.GetCollisionGeometriesForBody(other.GetBodyByName(b.name()))[0] for b in robot.bodies[1:]]
    free = {(i, j) for i in range(4) for j in range(i) if not inspector.CollisionFiltered(others[i], others[j])}
    assert free == {(3, 1)}


def test_a_file_converts_there_and_back(tmp_path):
    """URDF to SDFormat to URDF: three files, one dynamics; the two-hole block keeps its mesh."""
    import sheldrake

    source = sheldrake.model_path("two_hole_block/two_hole_block.urdf")
    first = ConvertModel(source, tmp_path / "a.sdf")
    second = ConvertModel(first.path, tmp_path / "b.urdf")
    assert first.losses == second.losses == []
    plant, graph, _ = load(S, source)
    for written in (first, second):
        other, other_graph = assert_same_dynamics(plant, S, written.path)
        body = plant.get_body(S.BodyIndex(1))
        twin = other.GetBodyByName(body.name())
        assert describe(S, plant, graph, body) == describe(S, other, other_graph, twin)


MJCF = """<mujoco model="m"><worldbody>
 <body name="a" pos="0 0 1"><joint name="j" type="hinge" axis="0 1 0" pos="0.1 0 0.2" range="-90 90" limited="true"/>
  <geom name="g" type="capsule" size="0.05 0.2" density="500"/>
  <body name="b" pos="0 0 0.4"><joint name="s" type="slide" axis="0 0 1" damping="2"/>
   <geom type="box" size="0.05 0.05 0.05"/></body></body>
 </worldbody><actuator><motor name="m1" joint="j" ctrlrange="-5 5"/></actuator></mujoco>"""


@pytest.mark.parametrize("library", LIBRARIES)
@pytest.mark.parametrize("format", ["urdf", "sdf"])
def test_mjcf_becomes_a_description(tmp_path, format, library):
    pytest.importorskip(library)
    (tmp_path / "m.xml").write_text(MJCF)
    written = ConvertModel(tmp_path / "m.xml", tmp_path / f"m.{format}")
    plant, _, _ = load(S, tmp_path / "m.xml")
    other, _ = assert_same_dynamics(plant, names(library), written.path)
    assert other.num_actuators() == 1


@pytest.mark.parametrize("library", LIBRARIES)
@pytest.mark.parametrize("format", ["urdf", "sdf"])
def test_meshes_that_drake_does_not_read_become_obj(tmp_path, format, library):
    pytest.importorskip(library)
    (tmp_path / "in").mkdir()
    (tmp_path / "in" / "part.stl").write_bytes(solids.binary_stl(*solids.box(0.06, 0.04, 0.025)))
    mesh = '<geometry><mesh filename="part.stl" scale="1 2 1"/></geometry>'
    text = f'<robot name="r"><link name="a"><inertial><mass value="1"/></inertial><visual>{mesh}</visual>'
    (tmp_path / "in" / "r.urdf").write_text(text + f"<collision>{mesh}</collision></link></robot>")
    kept = ConvertModel(tmp_path / "in" / "r.urdf", tmp_path / f"kept.{format}")
    assert "../" not in kept.path.read_text() and "in/part.stl" in kept.path.read_text() and kept.notes
    written = ConvertModel(tmp_path / "in" / "r.urdf", tmp_path / f"r.{format}", obj_meshes=True)
    assert written.files == [tmp_path / "part.obj"] and not written.notes and not written.losses
    plant, graph, _ = load(names(library), written.path)
    (geometry_id,) = plant.GetCollisionGeometriesForBody(plant.GetBodyByName("a"))
    hull = graph.model_inspector().GetConvexHull(geometry_id)
    corners = np.array([hull.vertex(i) for i in range(hull.num_vertices())])
    np.testing.assert_allclose(np.ptp(corners, axis=0), [0.06, 0.08, 0.025], rtol=1e-6)


def test_names_that_sdformat_takes_for_one_are_told_apart(tmp_path):
    urdf = """<robot name="r"><link name="base"/><link name="hand"><inertial><mass value="1"/>
      <inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial></link>
      <link name="finger"><inertial><mass value="1"/><inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/>
      </inertial></link><joint name="hand" type="revolute"><parent link="base"/><child link="hand"/>
      <axis xyz="0 0 1"/></joint><joint name="grip" type="prismatic"><parent link="hand"/><child link="finger"/>
      <axis xyz="0 1 0"/><mimic joint="hand" multiplier="2"/></joint></robot>"""
    (tmp_path / "r.urdf").write_text(urdf)
    written = ConvertModel(tmp_path / "r.urdf", tmp_path / "r.sdf")
    assert written.losses == ["joint 'hand' is called 'hand_joint': a link has its name"]
    plant, _, _ = load(S, written.path)
    assert plant.GetJointByName("hand_joint").child_body().name() == "hand" and plant.num_constraints() == 1


def test_several_models_become_one_and_it_is_said(tmp_path):
    urdf = '<robot name="{}"><link name="a"/><link name="b"><inertial><mass value="1"/></inertial></link>' \
           '<joint name="j" type="fixed"><parent link="a"/><child link="b"/></joint></robot>'  # fmt: skip
    for name in ("one", "two"):
        (tmp_path / f"{name}.urdf").write_text(urdf.format(name))
    plant, graph, _ = load(S, tmp_path / "one.urdf", tmp_path / "two.urdf")
    written = WriteModel(plant, tmp_path / "both.urdf", graph)
    assert any("2 model instances become one" in loss for loss in written.losses)
    assert any("link 'a' of model 'two' is called 'two_a'" in loss for loss in written.losses)
    other, _, _ = load(S, written.path)
    assert other.num_bodies() == 5 and other.HasBodyNamed("two_a")


def test_what_can_not_be_said_is_named(tmp_path):
    robot = Robot(False)
    joint = robot.joint(S.RevoluteJoint, [0, 0, 1])
    joint.set_default_angle(0.5)
    plant = robot.plant
    plant.mutable_gravity_field().set_gravity_vector([0, 0, -1.6])
    plant.RegisterCollisionGeometry(robot.bodies[-1], S.RigidTransform(), S.HalfSpace(), "g", S.CoulombFriction(1, 1))
    plant.AddDistanceConstraint(plant.world_body(), [0, 0, 0], robot.bodies[-1], [1, 0, 0], 1.0)
    robot.done()
    losses = "\n".join(WriteModel(plant, tmp_path / "r.urdf", robot.scene_graph).losses)
    for word in ("default position of joint", "gravity", "HalfSpace", "distance constraint"):
        assert word in losses
    with pytest.raises(ValueError, match="ends with none"):
        WriteModel(plant, tmp_path / "r.obj")
    robot = Robot(False)
    robot.joint(S.RpyFloatingJoint)
    with pytest.raises(NotImplementedError, match="rpy_floating"):
        WriteModel(robot.done(), tmp_path / "r.urdf")


@pytest.mark.parametrize("library", LIBRARIES)
def test_mjcf_says_gravity(tmp_path, library):
    """On the moon, and nowhere; what is as everywhere else is not said."""
    pytest.importorskip(library)
    for gravity in ([0.1, 0.0, -1.6], [0.0, 0.0, 0.0], [0.0, 0.0, -9.81]):
        option = f'<option gravity="{" ".join(map(str, gravity))}"/>'
        (tmp_path / "m.xml").write_text(MJCF.replace("<worldbody>", option + "<worldbody>", 1))
        written = ConvertModel(tmp_path / "m.xml", tmp_path / "n.xml")
        plant, _, _ = load(names(library), written.path)
        assert list(plant.gravity_field().gravity_vector()) == gravity
        assert not any("gravity" in loss for loss in written.losses)
        assert ("<option" in written.path.read_text()) == (gravity[2] != -9.81)


def test_a_planted_fault_is_seen(tmp_path):
    plant = Robot(False).with_all_joints().done()
    path = WriteModel(plant, tmp_path / "r.urdf").path
    text = path.read_text()
    at = text.index('value="', text.index("<mass"))
    mass = text[at + 7 : text.index('"', at + 7)]
    path.write_text(text.replace(mass, repr(float(mass) * (1 + 1e-9)), 1))
    with pytest.raises(AssertionError):
        assert_same_dynamics(plant, S, path)


def test_command_line(tmp_path, capsys):
    from sheldrake.cli import main

    (tmp_path / "m.xml").write_text(MJCF)
    assert main(["convert", str(tmp_path / "m.xml"), str(tmp_path / "m.urdf")]) == 0
    out = capsys.readouterr()
    assert "wrote" in out.out and "link 'j_frame' was added" in out.err
    assert main(["convert", str(tmp_path / "m.xml"), str(tmp_path / "m.urdf"), "--strict"]) == 3
    assert main(["convert", str(tmp_path / "absent.xml"), str(tmp_path / "m.urdf")]) == 1
    capsys.readouterr()
    assert main(["convert", str(tmp_path / "m.xml"), str(tmp_path / "m.urdf"), "--json"]) == 0
    said = json.loads(capsys.readouterr().out)
    assert said["files"] == [str(tmp_path / "m.urdf")] and any("j_frame" in loss for loss in said["losses"])
