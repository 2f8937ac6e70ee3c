import copy
import pickle

import numpy as np
import pytest

from sheldrake import geometry as g
from sheldrake.math import RigidTransform
from sheldrake.multibody.plant import CalcContactFrictionFromSurfaceProperties, CoulombFriction


@pytest.mark.parametrize("kind", [g.GeometryId, g.FrameId, g.SourceId, g.FilterId])
def test_ids_are_unique_ordered_hashable_and_typed(kind):
    a, b = kind.get_new_id(), kind.get_new_id()
    assert a < b and b > a and a != b and a == copy.copy(a)
    assert {a: 1}[copy.deepcopy(a)] == 1
    assert repr(a) == f"<{kind.__name__} value={a.get_value()}>"
    assert a != a.get_value()
    other = g.FrameId if kind is not g.FrameId else g.GeometryId
    assert a != other.get_new_id()
    with pytest.raises(TypeError, match="No constructor defined"):
        kind()
    with pytest.raises(AttributeError):
        a._value = 7


def test_roles_print_convert_and_sort():
    assert repr(g.Role.kProximity) == "<Role.kProximity: 1>"
    assert int(g.Role.kPerception) == 4 and g.Role(2) is g.Role.kIllustration
    assert g.Role.kUnassigned < g.Role.kProximity
    assert g.Role.kProximity != 1
    assert g.RoleAssign.kReplace.name == "kReplace"


def test_rgba():
    grey = g.Rgba(0.5, 0.5, 0.5)
    assert grey.a() == 1.0
    assert grey * g.Rgba(0.5, 1, 0.2) == g.Rgba(0.25, 0.5, 0.1)
    assert grey.scale_rgb(3) == g.Rgba()
    grey.update(g=0.25, a=0.75)
    assert repr(grey) == "Rgba(r=0.5, g=0.25, b=0.5, a=0.75)"
    grey.set([1, 0, 0])
    assert grey.rgba.tolist() == [1, 0, 0, 1]
    assert pickle.loads(pickle.dumps(grey)) == grey
    for bad in (lambda: g.Rgba(1, 2, 3), lambda: grey.set([1, 0]), lambda: grey.update(a=-1)):
        with pytest.raises(RuntimeError):
            bad()
    with pytest.raises(TypeError):
        g.Rgba(r=0.5, g=0.1)
    assert grey == g.Rgba(1, 0, 0)  # a failed change leaves the old value


def test_render_label():
    assert g.RenderLabel(5) == 5 and int(g.RenderLabel.kEmpty) == 32766
    assert repr(g.RenderLabel.kEmpty) == "RenderLabel.kEmpty"
    assert g.RenderLabel.kDontCare.is_reserved() and not g.RenderLabel(5).is_reserved()
    with pytest.raises(RuntimeError):
        g.RenderLabel(-1)


def test_properties():
    p = g.ProximityProperties()
    p.AddProperty("group", "x", 1.5)
    with pytest.raises(RuntimeError, match=r"AddProperty.*\('group', 'x'\).*already exists"):
        p.AddProperty("group", "x", 2.5)
    with pytest.raises(RuntimeError, match=r"New type std::string, existing type double"):
        p.UpdateProperty("group", "x", "text")
    p.UpdateProperty("group", "x", 2.5)
    assert p.GetProperty("group", "x") == 2.5
    with pytest.raises(RuntimeError, match=r"There is no property \('group', 'y'\)"):
        p.GetProperty("group", "y")
    with pytest.raises(RuntimeError, match="group does not exist"):
        p.GetProperty("other", "y")
    assert p.GetPropertyOrDefault("other", "y", 3) == 3
    assert p.GetGroupNames() == {"__default__", "group"} and p.num_groups() == 2
    twin = g.ProximityProperties(p)
    assert p.RemoveProperty("group", "x") and not p.RemoveProperty("group", "x")
    assert twin.HasProperty("group", "x")
    assert type(g.IllustrationProperties(twin)) is g.IllustrationProperties
    assert "[group]\n  x: double" in str(twin)
    with pytest.raises(TypeError):
        g.GeometryProperties()


def test_contact_material_both_argument_orders():
    friction = CoulombFriction(0.7, 0.5)
    new, old = g.ProximityProperties(), g.ProximityProperties()
    g.AddContactMaterial(properties=new, dissipation=1.5, point_stiffness=2, friction=friction)
    g.AddContactMaterial(1.5, 2, friction, old)
    for p in (new, old):
        assert p.GetProperty("material", "hunt_crossley_dissipation") == 1.5
        assert p.GetProperty("material", "point_contact_stiffness") == 2.0
        assert p.GetProperty("material", "coulomb_friction") == friction
    with pytest.raises(RuntimeError, match="dissipation can't be negative; given -1"):
        g.AddContactMaterial(g.ProximityProperties(), dissipation=-1)
    with pytest.raises(RuntimeError, match="strictly positive; given 0"):
        g.AddContactMaterial(g.ProximityProperties(), point_stiffness=0)
    with pytest.raises(TypeError):
        g.AddContactMaterial(g.IllustrationProperties(), point_stiffness=1)


def test_hydroelastic_and_phong_properties():
    p = g.ProximityProperties()
    g.AddRigidHydroelasticProperties(0.1, p)
    assert p.GetProperty("hydroelastic", "resolution_hint") == 0.1
    p = g.ProximityProperties()
    g.AddRigidHydroelasticProperties(properties=p)
    assert not p.HasProperty("hydroelastic", "resolution_hint")
    p = g.ProximityProperties()
    g.AddCompliantHydroelasticProperties(resolution_hint=0.1, hydroelastic_modulus=1e5, properties=p)
    assert p.GetProperty("hydroelastic", "hydroelastic_modulus") == 1e5
    with pytest.raises(RuntimeError, match="modulus must be positive"):
        g.AddCompliantHydroelasticPropertiesForHalfSpace(0.1, 0.0, g.ProximityProperties())
    phong = g.MakePhongIllustrationProperties([1, 0.5, 0.25, 0.5])
    assert phong.GetProperty("phong", "diffuse") == g.Rgba(1, 0.5, 0.25, 0.5)
    phong.GetProperty("phong", "diffuse").set(0, 0, 0)
    assert phong.GetProperty("phong", "diffuse") == g.Rgba(1, 0.5, 0.25, 0.5)


def test_coulomb_friction():
    pair = CalcContactFrictionFromSurfaceProperties(CoulombFriction(1.0, 1.0), CoulombFriction(0.7, 0.5))
    assert pair.dynamic_friction() == pytest.approx(2 / 3, rel=1e-15)
    assert CalcContactFrictionFromSurfaceProperties(CoulombFriction(), CoulombFriction()).static_friction() == 0
    assert pickle.loads(pickle.dumps(pair)) == pair
    with pytest.raises(RuntimeError, match="greater than"):
        CoulombFriction(0.3, 0.5)
    with pytest.raises(RuntimeError, match="dynamic friction is negative: -1"):
        CoulombFriction(-1, -1)


def test_configuration():
    config = g.SceneGraphConfig(default_proximity_properties=g.DefaultProximityProperties(margin=0.1))
    assert config.default_proximity_properties.margin == 0.1
    assert config.default_proximity_properties.point_stiffness == 1e6
    assert repr(copy.deepcopy(config)) == repr(config) != repr(g.SceneGraphConfig())
    with pytest.raises(AttributeError, match="no attribute 'bad'"):
        g.DefaultProximityProperties(bad=1)


def test_sets_take_ids_or_lists_of_one_kind():
    a, b, f = g.GeometryId.get_new_id(), g.GeometryId.get_new_id(), g.FrameId.get_new_id()
    s = g.GeometrySet([a, b], [f])
    assert s.geometries() == {a, b} and s.frames() == {f}
    assert g.GeometrySet(f).frames() == {f} and g.GeometrySet([]).geometries() == set()
    assert g.GeometrySet(frame_id=f).frames() == {f}
    with pytest.raises(TypeError, match="one kind"):
        g.GeometrySet([a, f])
    with pytest.raises(TypeError):
        g.GeometrySet(3)
    with pytest.raises(TypeError):
        g.GeometrySet(frame_ids=[a])


def test_frame_and_instance():
    frame = g.GeometryFrame("f", 3)
    assert (frame.name(), frame.frame_group(), copy.deepcopy(frame).id()) == ("f", 3, frame.id())
    with pytest.raises(RuntimeError):
        g.GeometryFrame("f", -1)
    with pytest.raises(TypeError):
        g.GeometryInstance(None, g.Sphere(1), "a")
    instance = g.GeometryInstance(RigidTransform(), g.Sphere(1), "  a b ")
    assert instance.name() == "a b" and instance.proximity_properties() is None
    instance.set_illustration_properties(g.MakePhongIllustrationProperties([1, 1, 1, 1]))
    twin = copy.copy(instance)
    twin.mutable_illustration_properties().AddProperty("a", "b", 1)
    assert twin.id() == instance.id() and not instance.illustration_properties().HasProperty("a", "b")
    with pytest.raises(RuntimeError, match="empty canonical string"):
        instance.set_name("  ")


def test_pose_vector():
    poses = g.FramePoseVector()
    f = g.FrameId.get_new_id()
    poses.set_value(id=f, value=np.eye(4))
    assert poses.size() == 1 and poses.has_id(f) and poses.ids() == [f]
    assert copy.deepcopy(poses).has_id(f)
    poses.clear()
    with pytest.raises(RuntimeError, match=f"No such FrameId: {f.get_value()}"):
        poses.value(f)
    with pytest.raises(TypeError):
        poses.set_value(g.GeometryId.get_new_id(), np.eye(4))


def test_results_of_no_query_name_no_geometry():
    pair = g.PenetrationAsPointPair()
    assert (
        isinstance(pair.id_A, g.GeometryId) and not pair.id_A.is_valid() and repr(pair.id_B) == "<GeometryId value=0>"
    )
    assert pair.depth == -1.0 and g.SignedDistancePair().distance == 0.0
    assert g.GeometryId.get_new_id().is_valid() and pair.id_A != g.GeometryId.get_new_id()
