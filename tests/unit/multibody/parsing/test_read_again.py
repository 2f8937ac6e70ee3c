"""What was read before is given again only while reading would find the same, and belongs to no plant."""

import concurrent.futures
import copy
import gc
import os
import types

import numpy as np
import pytest

from sheldrake.geometry import Role
from sheldrake.multibody.parsing import ParseError, Parser
from sheldrake.multibody.parsing._reading import remembered
from sheldrake.multibody.plant import AddMultibodyPlantSceneGraph, MultibodyPlant
from sheldrake.systems.framework import DiagramBuilder

LINK = (
    '<link name="{name}"><inertial><mass value="{mass}"/>'
    '<inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial>{more}</link>'
)
SHAPES = (
    '<visual><geometry><box size="1 2 3"/></geometry><material name="m"><color rgba="1 0 0 1"/></material>'
    '<drake:accepting_renderer name="eye"/></visual>'
    '<collision><origin xyz="0 0 1"/><geometry><sphere radius="0.1"/></geometry></collision>'
)


def robot(mass=1.0, more=""):
    joint = (
        '<joint name="j" type="revolute"><parent link="a"/><child link="b"/><origin xyz="1 0 0"/><axis xyz="0 1 0"/>'
        '<limit lower="-1" upper="1" effort="3"/></joint>'
        '<transmission type="transmission_interface/SimpleTransmission"><joint name="j"/>'
        '<actuator name="act"/></transmission>'
    )
    links = LINK.format(name="a", mass=mass, more=SHAPES) + LINK.format(name="b", mass=2.0, more=SHAPES)
    return f'<robot name="r" xmlns:drake="http://drake.mit.edu">{links}{joint}{more}</robot>'


@pytest.fixture(autouse=True)
def _nothing_known():
    remembered.forget_all()


@pytest.fixture
def readings(monkeypatch):
    """Counts how often something is read anew."""
    from sheldrake.multibody.parsing import _parser

    counted = []
    read = _parser.read_models

    def count(*args):
        counted.append(args)
        return read(*args)

    monkeypatch.setattr(_parser, "read_models", count)
    return counted


def scene():
    builder = DiagramBuilder()
    return AddMultibodyPlantSceneGraph(builder, 1e-3)


def sdf_of(mass):
    link = f'<link name="a"><inertial><mass>{mass}</mass></inertial></link>'
    return f'<sdf version="1.9"><model name="i">{link}</model></sdf>'


def mass_in(path, name="a"):
    plant, _ = scene()
    Parser(plant).AddModels(str(path))
    return plant.GetBodyByName(name).default_mass()


def test_a_text_is_read_once(readings):
    for _ in range(3):
        plant, _ = scene()
        (model,) = Parser(plant).AddModelsFromString(robot(), "urdf")
        assert plant.GetModelInstanceName(model) == "r" and plant.num_collision_geometries() == 2
    assert len(readings) == 1


def test_a_changed_file_is_seen(tmp_path, readings):
    path = tmp_path / "r.urdf"
    for mass in (1.0, 3.0):
        path.write_text(robot(mass))
        stat = path.stat()
        assert mass_in(path) == mass_in(path) == mass
        os.utime(path, ns=(stat.st_atime_ns, 0))  # what counts is what is in it
    assert len(readings) == 2


def test_a_changed_included_file_is_seen(tmp_path, readings):
    inner, outer = tmp_path / "inner.sdf", tmp_path / "outer.sdf"
    outer.write_text('<sdf version="1.9"><model name="o"><include><uri>inner.sdf</uri></include></model></sdf>')
    for mass in (1.0, 3.0):
        inner.write_text(sdf_of(mass))
        assert mass_in(outer) == mass_in(outer) == mass
    assert len(readings) == 2
    inner.unlink()
    with pytest.raises(ParseError, match="does not exist"):
        mass_in(outer)


def test_an_address_that_leads_elsewhere_is_seen(tmp_path, readings):
    text = '<sdf version="1.9"><model name="o"><include><uri>package://p/m.sdf</uri></include></model></sdf>'
    masses = []
    for mass in (1.0, 3.0):
        folder = tmp_path / str(mass)
        folder.mkdir()
        (folder / "m.sdf").write_text(sdf_of(mass))
        plant, _ = scene()
        parser = Parser(plant)
        parser.package_map().Add("p", str(folder))
        parser.AddModelsFromString(text, "sdf")
        masses.append(plant.GetBodyByName("a").default_mass())
    assert masses == [1.0, 3.0] and len(readings) == 2


def test_what_the_reader_knows_beforehand_counts(readings):
    Parser(scene()[0]).AddModelsFromString(robot(), "urdf")
    alone = MultibodyPlant(1e-3)  # without a scene graph shapes are not read
    Parser(alone).AddModelsFromString(robot(), "urdf")
    assert len(readings) == 2 and alone.num_bodies() == 3


def test_messages_are_said_again(readings):
    heard = []
    for _ in range(2):
        plant, _ = scene()
        parser = Parser(plant)
        parser.diagnostic_policy().SetActionForWarnings(heard.append)
        parser.AddModelsFromString(robot(more="<strange/>"), "urdf")
    assert len(heard) == 2 and heard[0] == heard[1] and "strange" in heard[0].message
    plant, _ = scene()
    parser = Parser(plant)
    parser.SetStrictParsing()
    mimic = robot(more="<verbose/>")
    with pytest.raises(ParseError, match="verbose"):
        parser.AddModelsFromString(mimic, "urdf")
    Parser(scene()[0]).AddModelsFromString(mimic, "urdf")
    with pytest.raises(ParseError, match="verbose"):  # read without a fault before, and a fault here all the same
        parser.AddModelsFromString(mimic, "urdf")
    assert plant.num_bodies() == 1


def reachable(*roots):
    """Objects that can be changed and belong to these, by identity."""
    skipped = (type, types.ModuleType, types.FunctionType, types.CodeType, property)
    found, todo = {}, list(roots)
    while todo:
        thing = todo.pop()
        if id(thing) in found or isinstance(thing, skipped):
            continue
        found[id(thing)] = thing
        todo += gc.get_referents(thing)
    return found


def test_plants_share_nothing_that_can_be_changed():
    plants = []
    for _ in range(2):
        plant, scene_graph = scene()
        Parser(plant).AddModelsFromString(robot(), "urdf")
        plants.append([vars(e) for e in (*plant._parts.elements.bodies, *plant._parts.elements.joints)])
        plants[-1] += [plant._parts.elements.frames, scene_graph._model.geometries]
    one, other = (reachable(*parts) for parts in plants)
    shared = [one[key] for key in one.keys() & other.keys()]
    assert not [a for a in shared if isinstance(a, np.ndarray) and a.flags.writeable and a.base is None and a.size]
    changeable = ("Properties", "RigidTransform", "SpatialInertia")
    assert not [p for p in shared if type(p) is set or type(p).__name__.endswith(changeable)]


def test_what_is_done_to_a_plant_reaches_no_other(readings):
    def told(plant, scene_graph):
        body = plant.GetBodyByName("a")
        inspector = scene_graph.model_inspector()
        shapes = [
            (str(inspector.GetShape(i)), inspector.GetPoseInFrame(i).GetAsMatrix34().tolist())
            for i in inspector.GetAllGeometryIds()
        ]
        labels = [
            inspector.GetPerceptionProperties(i).GetProperty("label", "id")
            for b in (body, plant.GetBodyByName("b"))
            for i in plant.GetVisualGeometriesForBody(b)
        ]
        joint = plant.GetJointByName("j")
        return shapes, [int(label) for label in labels], joint.position_lower_limits().tolist(), body.default_mass()

    plant, scene_graph = scene()
    Parser(plant).AddModelsFromString(robot(), "urdf")
    before = copy.deepcopy(told(plant, scene_graph))
    inspector = scene_graph.model_inspector()
    for geometry in inspector.GetAllGeometryIds():
        properties = inspector.GetProximityProperties(geometry) or inspector.GetPerceptionProperties(geometry)
        properties.AddProperty("own", "mark", 1)
    joint = plant.GetJointByName("j")
    joint.set_position_limits([-9.0], [9.0])
    joint.frame_on_parent().GetFixedPoseInBodyFrame().set_translation([7.0, 7.0, 7.0])
    plant.GetJointActuatorByName("act").set_effort_limit(77.0)
    again, graph = scene()
    Parser(again).AddModelsFromString(robot(), "urdf")
    assert len(readings) == 1 and told(again, graph) == before
    ids = graph.model_inspector().GetAllGeometryIds()
    found = [graph.model_inspector().GetProximityProperties(i) for i in ids]
    assert not any(p.HasProperty("own", "mark") for p in found if p is not None)


def test_old_readings_make_room(monkeypatch):
    monkeypatch.setattr(remembered, "MOST_BYTES", 3 * len(robot()))
    for mass in range(1, 9):
        Parser(scene()[0]).AddModelsFromString(robot(mass), "urdf")
    assert 1 <= len(remembered._KNOWN) <= 3


def test_threads_may_read_at_once(monkeypatch):
    monkeypatch.setattr(remembered, "MOST_BYTES", 2 * len(robot()))  # so that they push out each other's

    def masses(k):
        found = []
        for mass in (1.0 + k, 2.0, 3.0, 1.0 + k):
            plant, _ = scene()
            Parser(plant).AddModelsFromString(robot(mass), "urdf")
            found.append(plant.GetBodyByName("a").default_mass())
        return found

    with concurrent.futures.ThreadPoolExecutor(4) as threads:
        assert list(threads.map(masses, range(4))) == [[1.0 + k, 2.0, 3.0, 1.0 + k] for k in range(4)]


def told(plant, scene_graph):
    """All that a model says of its geometry and joints, in words and numbers; ids are those of the process."""
    inspector, found, model = scene_graph.model_inspector(), [], plant.GetModelInstanceByName("r")
    for body in map(plant.get_body, plant.GetBodyIndices(model)):
        frame = plant.GetBodyFrameIdOrThrow(body.index())
        found.append((body.name(), inspector.GetName(frame), inspector.GetFrameGroup(frame) - int(model)))
        shown, touched = plant.GetVisualGeometriesForBody(body), plant.GetCollisionGeometriesForBody(body)
        for geometry in [*shown, *touched]:
            properties = [inspector.GetProperties(geometry, role) for role in list(Role)[1:]]
            found.append((inspector.GetName(geometry), inspector.GetShape(geometry).to_string()))
            found.append(inspector.GetPoseInFrame(geometry).GetAsMatrix34().tolist())
            found.append([None if p is None else str(p) for p in properties])
            label = properties[2] and properties[2].GetProperty("label", "id")
            found.append((geometry in touched, None if label is None else int(label) - int(body.index())))
    for joint in map(plant.get_joint, plant.GetJointIndices(model)):
        found.append((joint.name(), joint.type_name(), joint.position_lower_limits().tolist()))
        found.append((joint.default_damping_vector().tolist(), joint.default_positions().tolist()))
    return found


def test_models_built_again_say_the_same():
    text = robot(more="").replace('<drake:accepting_renderer name="eye"/>', "")
    first, second = ((scene := _built(text))[0], scene[1]), _built(text, before=robot(mass=3.0).replace('"r"', '"q"'))
    assert told(*first) == told(*second)
    assert first[0].num_bodies() < second[0].num_bodies()  # so that numbers are others


def _built(text, before=None):
    plant, scene_graph = scene()
    parser = Parser(plant)
    if before is not None:
        parser.AddModelsFromString(before, "urdf")
    parser.AddModelsFromString(text, "urdf")
    plant.Finalize()
    return plant, scene_graph


def test_geometry_of_bodies_built_again_touches_and_is_filtered_as_at_first():
    text = robot().replace('<drake:accepting_renderer name="eye"/>', "")
    pairs = []
    for _ in range(2):
        plant, scene_graph = _built(text)
        inspector = scene_graph.model_inspector()
        a, b = (plant.GetCollisionGeometriesForBody(plant.GetBodyByName(name))[0] for name in "ab")
        pairs.append((inspector.CollisionFiltered(a, b), len(inspector.GetCollisionCandidates())))
    assert pairs == [(True, 0), (True, 0)]


def test_defaults_of_one_joint_are_not_those_of_the_next():
    slides = "<drake:parent>world</drake:parent><drake:child>a</drake:child><drake:damping>0 0 0</drake:damping>"
    text = (
        '<sdf version="1.7"><model name="r" xmlns:drake="http://drake.mit.edu"><link name="a"/>'
        f'<drake:joint name="j" type="planar">{slides}</drake:joint></model></sdf>'
    )
    found = []
    for x in (0.5, None):
        plant = MultibodyPlant(0.0)
        Parser(plant).AddModelsFromString(text, "sdf")
        joint = plant.GetJointByName("j")
        if x is not None:
            joint.set_default_translation([x, 0.0])
        found.append(joint.default_positions()[0])
    assert found == [0.5, 0.0]


def test_a_mesh_that_was_changed_is_seen(tmp_path):
    mesh = tmp_path / "m.obj"
    shape = '<collision><geometry><mesh filename="m.obj"/></geometry></collision>'
    link = LINK.format(name="a", mass=1.0, more=shape)
    (tmp_path / "r.urdf").write_text(f'<robot name="r">{link}</robot>')
    heights = []
    for height in (1.0, 2.0):
        corners = "".join(f"v {x}\n" for x in ("0 0 0", "1 0 0", "0 1 0", f"0 0 {height}"))
        mesh.write_text(corners + "f 1 3 2\nf 1 2 4\nf 2 3 4\nf 1 4 3\n")
        plant, scene_graph = scene()
        Parser(plant).AddModels(str(tmp_path / "r.urdf"))
        inspector = scene_graph.model_inspector()
        hull = inspector.GetConvexHull(inspector.GetAllGeometryIds()[0])
        heights.append(max(hull.vertex(k)[2] for k in range(hull.num_vertices())))
    assert heights == [1.0, 2.0]


def test_what_is_declared_alike_is_changed_for_one_plant_alone():
    first, second = MultibodyPlant(0.0), MultibodyPlant(0.0)
    for plant in (first, second):
        Parser(plant).AddModelsFromString(robot(), "urdf")
        plant.Finalize()
    assert first._outputs[3] is second._outputs[3]  # so it is shared
    first.get_body_poses_output_port().disable_caching_by_default()
    entries = [plant.get_body_poses_output_port().cache_entry() for plant in (first, second)]
    disabled = [e.is_cache_entry_disabled(p.CreateDefaultContext()) for e, p in zip(entries, (first, second))]
    assert disabled == [True, False]
    second.get_net_actuation_output_port().cache_entry().disable_caching_by_default()
    assert not first.get_net_actuation_output_port().cache_entry().is_disabled_by_default()


def test_plants_with_other_model_instances_have_other_ports():
    names = []
    for model in ("r", "other"):
        plant = MultibodyPlant(0.001)
        Parser(plant).AddModelsFromString(robot().replace('name="r"', f'name="{model}"'), "urdf")
        plant.Finalize()
        names.append({plant.get_output_port(i).get_name() for i in range(plant.num_output_ports())})
        assert plant.GetOutputPort(f"{model}_state").size() == plant.num_multibody_states()
        assert plant.GetInputPort(f"{model}_actuation").size() == 1
    assert "r_state" in names[0] - names[1]
