import numpy as np
import pytest

from sheldrake import geometry as g
from sheldrake.common.value import AbstractValue, Value
from sheldrake.geometry._kernels.model import Geometry
from sheldrake.math import RigidTransform, RollPitchYaw
from sheldrake.multibody.math._coulomb_friction import CoulombFriction
from sheldrake.systems.framework import DiagramBuilder, LeafSystem


def instance(name, shape=None, proximity=True, X=None):
    made = g.GeometryInstance(X or RigidTransform(), shape or g.Sphere(0.5), name)
    if proximity:
        made.set_proximity_properties(g.ProximityProperties())
    return made


class World:
    """Two frames, one moving with the other, three geometries and the ground."""

    def __init__(self):
        self.scene_graph = sg = g.SceneGraph()
        self.source = sg.RegisterSource("source")
        self.frame = sg.RegisterFrame(self.source, g.GeometryFrame("frame"))
        self.child = sg.RegisterFrame(self.source, self.frame, g.GeometryFrame("child", 2))
        self.a = sg.RegisterGeometry(self.source, self.frame, instance("a", X=RigidTransform([0, 0, 0.5])))
        self.b = sg.RegisterGeometry(self.source, self.child, instance("b", g.Box(1, 1, 1)))
        self.plain = sg.RegisterGeometry(self.source, self.frame, instance("plain", proximity=False))
        self.ground = sg.RegisterAnchoredGeometry(self.source, instance("ground", g.HalfSpace()))
        self.inspector = sg.model_inspector()

    def context(self, z=0.0, child=5.0):
        context = self.scene_graph.CreateDefaultContext()
        self.place(context, z, child)
        return context

    def place(self, context, z, child):
        poses = g.FramePoseVector()
        poses.set_value(self.frame, RigidTransform([0, 0, z]))
        poses.set_value(self.child, RigidTransform([0, 0, child]))
        self.scene_graph.get_source_pose_port(self.source).FixValue(context, poses)

    def query(self, context):
        return self.scene_graph.get_query_output_port().Eval(context)


@pytest.fixture
def world():
    return World()


def test_ports_are_named_after_the_source(world):
    sg = world.scene_graph
    assert sg.get_source_pose_port(world.source).get_name() == "source_pose"
    assert sg.get_source_configuration_port(world.source).get_name() == "source_configuration"
    assert sg.get_query_output_port().get_name() == "query"
    assert (sg.num_input_ports(), sg.num_output_ports()) == (2, 1)
    with pytest.raises(RuntimeError, match="unknown source id"):
        sg.get_source_pose_port(g.SourceId.get_new_id())


def test_inspector_counts_and_names(world):
    i = world.inspector
    assert (i.num_sources(), i.num_frames(), i.num_geometries()) == (2, 3, 4)
    assert (i.NumDynamicGeometries(), i.NumAnchoredGeometries()) == (3, 1)
    assert i.GetAllGeometryIds() == [world.a, world.b, world.plain, world.ground]
    assert i.GetAllGeometryIds(g.Role.kProximity) == [world.a, world.b, world.ground]
    assert i.NumGeometriesWithRole(g.Role.kUnassigned) == 1
    assert i.GetGeometries(world.frame, g.Role.kProximity) == [world.a]
    assert i.GetGeometryIdByName(world.frame, g.Role.kProximity, " a ") == world.a
    assert i.GetGeometryIds(g.GeometrySet([world.frame])) == {world.a, world.plain}
    assert i.GetName(world.source) == i.GetOwningSourceName(world.a) == "source"
    assert i.GetName(world.child) == "child" and i.GetName(geometry_id=world.a) == "a"
    assert i.GetFrameGroup(world.child) == 2 and i.GetFrameId(world.ground) == i.world_frame_id()
    assert i.GetParentFrame(world.child) == world.frame and i.GetParentFrame(world.frame) == i.world_frame_id()
    with pytest.raises(RuntimeError, match="not been registered"):
        i.GetParentFrame(g.FrameId.get_new_id())
    assert i.BelongsToSource(world.a, world.source) and i.BelongsToSource(frame_id=world.frame, source_id=world.source)
    assert i.FramesForSource(world.source) == {world.frame, world.child}
    assert repr(i.GetShape(world.b)) == "Box(width=1, depth=1, height=1)"
    clone = i.CloneGeometryInstance(world.a)
    assert clone.id() != world.a and clone.name() == "a" and clone.proximity_properties() is not None
    assert i.GetConvexHull(world.a) is None and i.GetObbInGeometryFrame(world.b).half_width().tolist() == [0.5] * 3


@pytest.mark.parametrize(
    "call, message",
    [
        (lambda w: w.scene_graph.RegisterSource("source"), "duplicate name: source"),
        (lambda w: w.scene_graph.RegisterFrame(w.source, g.GeometryFrame("frame")), "duplicate name 'frame'"),
        (lambda w: w.scene_graph.RegisterFrame(w.source, g.FrameId.get_new_id(), g.GeometryFrame("x")), "parent id"),
        (lambda w: w.scene_graph.RegisterFrame(g.SourceId.get_new_id(), g.GeometryFrame("x")), "is not registered"),
        (lambda w: w.scene_graph.RegisterGeometry(w.source, w.frame, instance("a")), "'proximity' role"),
        (lambda w: w.scene_graph.RegisterGeometry(w.source, g.FrameId.get_new_id(), instance("z")), "doesn't belong"),
        (lambda w: w.scene_graph.AssignRole(w.source, w.a, g.ProximityProperties()), "for the first time"),
        (
            lambda w: w.scene_graph.AssignRole(w.source, w.a, g.IllustrationProperties(), g.RoleAssign.kReplace),
            "has not had the role",
        ),
        (lambda w: w.scene_graph.RemoveGeometry(w.source, g.GeometryId.get_new_id()), "has not been registered"),
        (lambda w: w.scene_graph.RenameFrame(w.child, "frame"), "already existing name"),
        (lambda w: w.inspector.GetName(g.FrameId.get_new_id()), "No frame name"),
        (lambda w: w.inspector.GetShape(g.GeometryId.get_new_id()), "invalid geometry id"),
        (lambda w: w.inspector.CollisionFiltered(w.a, w.plain), "does not have a proximity role"),
        (lambda w: w.inspector.GetGeometryIdByName(w.frame, g.Role.kProximity, "zz"), r"associated.*\{a\}"),
    ],
)
def test_errors_say_what_and_change_nothing(world, call, message):
    before = world.inspector.num_geometries(), world.inspector.num_frames(), world.inspector.num_sources()
    with pytest.raises(RuntimeError, match=message):
        call(world)
    assert before == (world.inspector.num_geometries(), world.inspector.num_frames(), world.inspector.num_sources())


def test_wrong_argument_types(world):
    with pytest.raises(TypeError, match="RegisterGeometry"):
        world.scene_graph.RegisterGeometry(world.source, world.frame, None)
    with pytest.raises(TypeError, match="RegisterFrame"):
        world.scene_graph.RegisterFrame(world.source, "frame")
    with pytest.raises(TypeError):
        g.SceneGraphInspector()


def test_roles_come_and_go(world):
    sg, i = world.scene_graph, world.inspector
    colour = g.MakePhongIllustrationProperties([1, 0, 0, 1])
    version = i.geometry_version()
    sg.AssignRole(world.source, world.a, colour)
    assert i.GetIllustrationProperties(world.a).GetProperty("phong", "diffuse") == g.Rgba(1, 0, 0)
    assert not i.geometry_version().IsSameAs(version, g.Role.kIllustration)
    assert i.geometry_version().IsSameAs(version, g.Role.kProximity)
    assert sg.RemoveRole(world.source, world.frame, g.Role.kIllustration) == 1
    assert sg.RemoveRole(world.source, geometry_id=world.a, role=g.Role.kIllustration) == 0
    assert i.GetIllustrationProperties(world.a) is None
    sg.RemoveGeometry(world.source, world.plain)
    assert i.num_geometries() == 3


@pytest.mark.parametrize("shape", [g.Mesh, g.Convex])
@pytest.mark.parametrize("file, reason", [("missing.obj", "cannot read the file"), ("notes.txt", "extension '.txt'")])
def test_a_mesh_that_cannot_be_touched_is_refused_when_it_gets_the_role(world, tmp_path, shape, file, reason):
    (tmp_path / "notes.txt").write_text("nothing to touch")
    sg, mesh = world.scene_graph, shape(str(tmp_path / file), 1.0)
    before = world.inspector.num_geometries()
    with pytest.raises(RuntimeError, match=reason):
        sg.RegisterGeometry(world.source, world.frame, instance("mesh", mesh))
    assert world.inspector.num_geometries() == before
    seen = sg.RegisterGeometry(world.source, world.frame, instance("mesh", mesh, proximity=False))
    with pytest.raises(RuntimeError, match=reason):
        sg.AssignRole(world.source, seen, g.ProximityProperties())
    assert world.inspector.GetProximityProperties(seen) is None
    with pytest.raises(RuntimeError, match=reason):
        sg.ChangeShape(world.source, world.a, mesh)
    assert type(world.inspector.GetShape(world.a)) is g.Sphere


def test_shapes_and_names_change(world):
    sg, i = world.scene_graph, world.inspector
    sg.ChangeShape(world.source, world.a, g.Sphere(2.0))
    assert i.GetShape(world.a).radius() == 2 and i.GetPoseInFrame(world.a).translation()[2] == 0.5
    sg.ChangeShape(world.source, world.a, g.Sphere(2.0), X_FG=RigidTransform())
    assert i.GetPoseInFrame(world.a).translation()[2] == 0
    sg.RenameFrame(world.frame, "new")
    sg.RenameGeometry(world.a, "aa")
    assert (i.GetName(world.frame), i.GetName(world.a)) == ("new", "aa")


def test_default_proximity_properties_fill_only_what_is_missing():
    sg = g.SceneGraph(g.SceneGraphConfig(default_proximity_properties=g.DefaultProximityProperties(point_stiffness=7)))
    source = sg.RegisterSource()
    shape = instance("a")
    g.AddContactMaterial(shape.mutable_proximity_properties(), friction=CoulombFriction(1, 1))
    a = sg.RegisterAnchoredGeometry(source, shape)
    assert not sg.model_inspector().GetProximityProperties(a).HasProperty("material", "point_contact_stiffness")
    context = sg.CreateDefaultContext()
    properties = sg.get_query_output_port().Eval(context).inspector().GetProximityProperties(a)
    assert properties.GetProperty("material", "point_contact_stiffness") == 7
    assert properties.GetProperty("material", "hunt_crossley_dissipation") == 50
    assert properties.GetProperty("material", "coulomb_friction") == CoulombFriction(1, 1)
    assert sg.get_config(context).default_proximity_properties.point_stiffness == 7
    for bad in ({"dynamic_friction": 3}, {"point_stiffness": -1}, {"static_friction": None}, {"compliance_type": "q"}):
        with pytest.raises(RuntimeError):
            sg.set_config(g.SceneGraphConfig(default_proximity_properties=g.DefaultProximityProperties(**bad)))


def test_poses(world):
    query = world.query(world.context(z=1.0, child=2.0))
    assert query.GetPoseInWorld(world.child).translation().tolist() == [0, 0, 3]
    assert query.GetPoseInParent(world.child).translation().tolist() == [0, 0, 2]
    assert query.GetPoseInWorld(geometry_id=world.a).translation().tolist() == [0, 0, 1.5]
    assert query.GetPoseInWorld(world.ground).IsExactlyIdentity()


def test_missing_poses_are_explained(world):
    context = world.scene_graph.CreateDefaultContext()
    query = world.query(context)
    with pytest.raises(RuntimeError, match=r"'source'.*not connected"):
        query.GetPoseInWorld(world.frame)
    poses = g.FramePoseVector()
    poses.set_value(world.frame, RigidTransform())
    world.scene_graph.get_source_pose_port(world.source).FixValue(context, poses)
    with pytest.raises(RuntimeError, match=r"expected number of frames \(2\).*\(1\)"):
        query.GetPoseInWorld(world.frame)
    with pytest.raises(RuntimeError, match="invalid QueryObject"):
        g.QueryObject().inspector().num_frames()


def test_query_looks_at_the_present_poses(world):
    context = world.context(z=5.0)
    query = world.query(context)
    assert not query.HasCollisions()
    world.place(context, z=-0.2, child=5.0)
    (pair,) = query.ComputePointPairPenetration()
    assert (pair.id_A, pair.id_B) == (world.a, world.ground)
    assert pair.depth == pytest.approx(0.2) and pair.nhat_BA_W.tolist() == [0, 0, 1]
    assert query.HasCollisions() and query.FindCollisionCandidates() == [(world.a, world.ground)]


def test_changing_a_context_leaves_model_and_clones_alone(world):
    context = world.context(z=-0.2)
    clone = context.Clone()
    late = world.scene_graph.RegisterGeometry(context, world.source, world.frame, instance("late"))
    world.scene_graph.RemoveGeometry(context, world.source, world.a)
    inspector = world.query(context).inspector()
    assert inspector.num_geometries() == 4
    assert inspector.GetProximityProperties(late).HasProperty("material", "point_contact_stiffness")
    assert world.query(clone).inspector().GetName(world.a) == "a" == world.inspector.GetName(world.a)
    assert [p.id_A for p in world.query(clone).ComputePointPairPenetration()] == [world.a]
    assert [p.id_B for p in world.query(context).ComputePointPairPenetration()] == [late]


def test_filters_persistent_and_transient(world):
    sg, i = world.scene_graph, world.inspector
    candidates = {(world.a, world.b), (world.a, world.ground), (world.b, world.ground)}
    assert i.GetCollisionCandidates() == candidates
    manager = sg.collision_filter_manager()
    everything = g.GeometrySet([world.a, world.b, world.ground])
    manager.Apply(
        g.CollisionFilterDeclaration()
        .ExcludeWithin(everything)
        .AllowBetween(g.GeometrySet(world.frame), g.GeometrySet(world.ground))
    )
    assert i.GetCollisionCandidates() == {(world.a, world.ground)}
    allow = manager.ApplyTransient(g.CollisionFilterDeclaration().AllowWithin(everything))
    exclude = manager.ApplyTransient(
        g.CollisionFilterDeclaration().ExcludeBetween(g.GeometrySet(world.a), g.GeometrySet(world.b))
    )
    assert manager.has_transient_history() and manager.IsActive(allow)
    assert i.GetCollisionCandidates() == candidates - {(world.a, world.b)}
    with pytest.raises(RuntimeError, match="transient filter declarations"):
        manager.Apply(g.CollisionFilterDeclaration())
    assert manager.RemoveDeclaration(allow) and not manager.RemoveDeclaration(allow)
    assert i.CollisionFiltered(world.b, world.ground) and not i.CollisionFiltered(world.a, world.ground)
    assert manager.RemoveDeclaration(exclude) and not manager.has_transient_history()
    assert i.CollisionFiltered(world.a, world.a)
    with pytest.raises(RuntimeError, match="doesn't belong to the SceneGraph"):
        manager.Apply(g.CollisionFilterDeclaration().ExcludeWithin(g.GeometrySet(g.GeometryId.get_new_id())))


def test_candidates_asked_again_follow_filters_and_geometry(world):
    sg, i = world.scene_graph, world.inspector
    candidates = {(world.a, world.b), (world.a, world.ground), (world.b, world.ground)}
    i.GetCollisionCandidates().clear()
    assert i.GetCollisionCandidates() == candidates
    manager = sg.collision_filter_manager()
    both = g.GeometrySet([world.a, world.b])
    transient = manager.ApplyTransient(g.CollisionFilterDeclaration().ExcludeWithin(both))
    context = sg.CreateDefaultContext()
    of_context = sg.collision_filter_manager(context)
    asked = lambda: sg.get_query_output_port().Eval(context).inspector().GetCollisionCandidates()  # noqa: E731
    assert i.GetCollisionCandidates() == asked() == candidates - {(world.a, world.b)}
    assert of_context.RemoveDeclaration(transient)
    assert asked() == candidates and i.GetCollisionCandidates() == candidates - {(world.a, world.b)}
    assert manager.RemoveDeclaration(transient)
    assert i.GetCollisionCandidates() == candidates
    sg.RemoveGeometry(world.source, world.b)
    assert i.GetCollisionCandidates() == {(world.a, world.ground)} and asked() == candidates


def test_filters_of_a_context_are_its_own(world):
    context = world.context(z=-0.2)
    manager = world.scene_graph.collision_filter_manager(context)
    manager.Apply(g.CollisionFilterDeclaration().ExcludeBetween(g.GeometrySet(world.a), g.GeometrySet(world.ground)))
    assert not world.query(context).HasCollisions()
    assert not world.inspector.CollisionFiltered(world.a, world.ground)


def test_compiled_model_numbers_bodies_and_pairs(world):
    bodies = {world.scene_graph.world_frame_id(): 0, world.frame: 3, world.child: 4}
    model, ids = world.scene_graph._compile_proximity(bodies)
    assert ids == [world.a, world.b, world.ground]
    assert model.geometry[:, 1].tolist() == [3, 4, 0]
    assert model.pair.tolist() == [[0, 2], [1, 2], [0, 1]]  # pairs with a half space come first
    assert model.material[0].tolist() == [1e6, 50, 0.1, 0.5, 0.5]
    bodies[world.child] = 3  # the same body: never in contact with itself
    assert world.scene_graph._compile_proximity(bodies)[0].pair.tolist() == [[0, 2], [1, 2]]
    del bodies[world.child]  # what moves with none of them is left out
    model, ids = world.scene_graph._compile_proximity(bodies)
    assert ids == [world.a, world.ground] and model.pair.tolist() == [[0, 1]]


def test_point_contact_algorithm_of_what_does_not_say(world):
    graph, bodies = world.scene_graph, {world.scene_graph.world_frame_id(): 0, world.frame: 1, world.child: 2}
    properties = g.ProximityProperties()
    g.AddContactMaterial(properties, friction=CoulombFriction(0.5, 0.5))
    properties.AddProperty("material", "point_contact_algorithm", "multi_point")
    graph.AssignRole(world.source, world.plain, properties)

    def several(graph):
        model, ids = graph._compile_proximity(bodies)
        return {i for i, row in zip(ids, model.geometry) if row[Geometry.multi_point]}

    everything = several(graph)
    assert world.plain in everything and len(everything) > 1
    graph.set_default_point_contact_algorithm("single_point")
    assert several(graph) == {world.plain} == several(graph.Clone())
    with pytest.raises(RuntimeError, match=r"'many'.*'multi_point', 'single_point'"):
        graph.set_default_point_contact_algorithm("many")


def test_bad_material_is_named(world):
    properties = g.ProximityProperties()
    properties.AddProperty("material", "point_contact_algorithm", "many")
    world.scene_graph.AssignRole(world.source, world.plain, properties)
    bodies = {world.scene_graph.world_frame_id(): 0, world.frame: 1, world.child: 2}
    with pytest.raises(RuntimeError, match=r"'plain'.*'many'.*'multi_point', 'single_point'"):
        world.scene_graph._compile_proximity(bodies)


def test_in_a_diagram_with_a_source_and_a_listener(world):
    class Source(LeafSystem):
        def __init__(self):
            super().__init__()
            self.DeclareAbstractOutputPort("pose", lambda: AbstractValue.Make(g.FramePoseVector()), self.calc)

        def calc(self, context, output):
            poses = g.FramePoseVector()
            poses.set_value(world.frame, RigidTransform([0, 0, -context.get_time()]))
            poses.set_value(world.child, RigidTransform([0, 0, 9]))
            output.set_value(poses)

    class Listener(LeafSystem):
        def __init__(self):
            super().__init__()
            self.DeclareAbstractInputPort("query", Value[g.QueryObject]())
            self.DeclareVectorOutputPort("depth", 1, self.calc)

        def calc(self, context, output):
            pairs = self.get_input_port(0).Eval(context).ComputePointPairPenetration()
            output.SetFromVector([sum(p.depth for p in pairs)])

    builder = DiagramBuilder()
    scene_graph = builder.AddSystem(world.scene_graph)
    source, listener = builder.AddSystem(Source()), builder.AddSystem(Listener())
    builder.Connect(source.get_output_port(0), scene_graph.get_source_pose_port(world.source))
    builder.Connect(scene_graph.get_query_output_port(), listener.get_input_port(0))
    diagram = builder.Build()
    context = diagram.CreateDefaultContext()
    depth = listener.get_output_port(0)
    for time in (0.1, 0.3, 0.2):
        context.SetTime(time)
        assert depth.Eval(listener.GetMyContextFromRoot(context)) == pytest.approx([time])


def test_other_scalars_and_clones_have_a_model_of_their_own(world):
    from sheldrake.autodiffutils import AutoDiffXd

    for other in (world.scene_graph.ToAutoDiffXd(), world.scene_graph.Clone()):
        world.scene_graph.RegisterFrame(world.source, g.GeometryFrame(f"later {type(other).__name__}"))
        assert other.model_inspector().num_frames() == 3 < world.inspector.num_frames()
        query = other.get_query_output_port().Eval(other.CreateDefaultContext())
        assert query.inspector().num_frames() == 3
        world = World()
    assert isinstance(world.scene_graph.ToAutoDiffXd(), g.SceneGraph_[AutoDiffXd])
    assert g.SceneGraph_[float] is g.SceneGraph and g.FramePoseVector_[AutoDiffXd] is g.FramePoseVector


def test_bounding_boxes_and_planes():
    X = RigidTransform(RollPitchYaw(0.3, 0.2, 0.1).ToRotationMatrix(), [0.1, 0.2, 0.3])
    box = g.Obb(X, [1, 2, 3])
    assert box.CalcVolume() == 48 and box.Equal(g.Obb(X, [1, 2, 3]))
    aabb = g.Aabb([1, 0, 0], [1, 1, 1])
    assert aabb.lower().tolist() == [0, -1, -1] and aabb.upper().tolist() == [2, 1, 1]
    assert g.Aabb.HasOverlap(aabb, box, RigidTransform()) and not g.Aabb.HasOverlap(
        aabb, box, RigidTransform([9, 0, 0])
    )
    plane = g.Plane(normal=[0, 0, 2], point_on_plane=[0, 0, 1])
    assert plane.CalcHeight([5, 5, 3]) == 2
    assert g.Aabb.HasOverlap(aabb, plane, RigidTransform()) and not g.Aabb.HasOverlap(
        aabb, plane, RigidTransform([0, 0, 3])
    )
    assert g.Obb.HasOverlap(box, g.HalfSpace(), RigidTransform())
    assert g.CalcObb(g.HalfSpace()) is None and g.CalcObb(g.Capsule(1, 2)).half_width().tolist() == [1, 1, 2]
    with pytest.raises(RuntimeError, match="normal"):
        g.Plane([0, 0, 0], [0, 0, 0])


@pytest.mark.parametrize("seed", range(3))
def test_box_overlap_agrees_with_contact(seed):
    """The same separating axes decide overlap of bounding boxes and contact of boxes."""
    from proximity_scenes import Scene, random_pose

    rng = np.random.default_rng(seed)
    scene = Scene([g.Box(1, 2, 3), g.Box(2, 1, 1)])
    a, b = g.Obb(RigidTransform(), [0.5, 1, 1.5]), g.Obb(RigidTransform(), [1, 0.5, 0.5])
    for _ in range(60):
        X, Y = random_pose(rng, 1.2), random_pose(rng, 1.2)
        assert g.Obb.HasOverlap(a, b, X.inverse() @ Y) == (len(scene.contacts(X, Y)) > 0)


def test_boxes_around_geometry_move_with_it_and_are_the_callers_own():
    world = World()
    context = world.context(z=2.0, child=5.0)
    query = world.scene_graph.get_query_output_port().Eval(context)
    for z in (2.0, 3.0):
        world.place(context, z, 5.0)
        for geometry, half_width in ((world.a, 0.5), (world.b, 0.5)):
            box = query.ComputeObbInWorld(geometry)
            assert box.pose().IsExactlyEqualTo(query.GetPoseInWorld(geometry))
            assert box.half_width().tolist() == [half_width] * 3
            assert not box.half_width().flags.writeable
            box.pose().SetIdentity()
            local = world.inspector.GetObbInGeometryFrame(geometry)
            assert local.Equal(g.CalcObb(world.inspector.GetShape(geometry)))
            assert local is not world.inspector.GetObbInGeometryFrame(geometry)
    assert query.ComputeObbInWorld(world.ground) is None and world.inspector.GetObbInGeometryFrame(world.ground) is None
