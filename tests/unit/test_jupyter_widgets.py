"""Sliders of a notebook as systems; the same as pydrake's."""

import importlib

import numpy as np
import pytest
from tests.libraries import names_of

pytest.importorskip("ipywidgets")
pytest.importorskip("IPython")

MODULES = ("systems.jupyter_widgets", "multibody.jupyter_widgets", "multibody.plant", "multibody.parsing", "math",
           "systems.framework")  # fmt: skip
ARM = """<robot name='arm'><link name='base'/><link name='upper'><inertial><mass value='1'/>
<inertia ixx='1' iyy='1' izz='1' ixy='0' ixz='0' iyz='0'/></inertial></link>
<joint name='weld' type='fixed'><parent link='world'/><child link='base'/></joint>
<joint name='hinge' type='revolute'><axis xyz='0 0 1'/><parent link='base'/><child link='upper'/>
<limit lower='-0.5' upper='20' effort='1' velocity='1'/></joint><link name='world'/></robot>"""
LOOSE = """<robot name='loose'><link name='block'><inertial><mass value='1'/>
<inertia ixx='1' iyy='1' izz='1' ixy='0' ixz='0' iyz='0'/></inertial></link></robot>"""


def library(name):
    return names_of(name, *MODULES)


@pytest.fixture(params=["sheldrake", pytest.param("pydrake", marks=pytest.mark.peer)])
def lib(request):
    pytest.importorskip(request.param)
    return library(request.param)


@pytest.fixture
def shown(monkeypatch):
    """The widgets that were displayed."""
    import IPython.display

    widgets = []
    monkeypatch.setattr(IPython.display, "display", widgets.append)
    for name in ("pydrake.systems.jupyter_widgets", "pydrake.multibody.jupyter_widgets"):
        try:
            module = importlib.import_module(name)
        except ImportError:
            continue
        if module.__name__.startswith("pydrake"):
            monkeypatch.setattr(module, "display", widgets.append)
    return widgets


def plant_of(lib):
    plant = lib.MultibodyPlant(0.0)
    parser = lib.Parser(plant)
    parser.AddModelsFromString(LOOSE, "urdf")
    parser.AddModelsFromString(ARM, "urdf")
    plant.Finalize()
    return plant


def test_pose_sliders(lib, shown):
    sliders = lib.PoseSliders(visible=lib.PoseSliders.Visible(yaw=False), value=lib.PoseSliders.Value(x=0.25))
    assert [w.description for w in shown] == ["roll", "pitch", "x", "y", "z"]
    context = sliders.CreateDefaultContext()
    np.testing.assert_allclose(sliders.GetOutputPort("pose").Eval(context).translation(), [0.25, 0, 0])
    X = lib.RigidTransform(lib.RollPitchYaw(0.1, 0.2, 0.3), [0.4, 0.5, 0.6])
    sliders.SetPose(X)
    assert shown[-1].value == pytest.approx(0.6)
    shown[0].value = 0.7
    context = sliders.CreateDefaultContext()
    found = sliders.GetOutputPort("pose").Eval(context)
    np.testing.assert_allclose(lib.RollPitchYaw(found.rotation()).vector(), [0.7, 0.2, 0.3], atol=1e-12)
    np.testing.assert_allclose(found.translation(), [0.4, 0.5, 0.6], atol=1e-12)


def test_widget_system(lib, shown):
    import ipywidgets

    a, b, c = ipywidgets.IntSlider(value=3), ipywidgets.FloatSlider(value=1.5), ipywidgets.Checkbox(value=True)
    system = lib.WidgetSystem([a, b], (c,), update_period_sec=0.2)
    assert shown == [a, b, c] and system.num_output_ports() == 2
    context = system.CreateDefaultContext()
    np.testing.assert_array_equal(system.GetOutputPort("widget_group_0").Eval(context), [3.0, 1.5])
    np.testing.assert_array_equal(system.GetOutputPort("widget_group_1").Eval(context), [1.0])


def test_joint_sliders(lib, shown):
    plant = plant_of(lib)
    sliders = lib.JointSliders(plant, lower_limit=-1.0, upper_limit=2.0)
    slider, *others = shown
    assert (slider.description, slider.min, slider.max, slider.value) == ("hinge", -0.5, 2.0, 0.0)
    assert [w.description for w in others] == [f"block[{k}]" for k in range(7)]
    hinge = plant.GetJointByName("hinge").position_start()
    sliders.set_joint_positions([1.25, 1, 0, 0, 0, 0, 0, 0.5])
    q = sliders.get_output_port(0).Eval(sliders.CreateDefaultContext())
    assert q[hinge] == 1.25 and np.count_nonzero(q) == 3
    sliders.set_positions(np.full(plant.num_positions(), 0.5))
    assert {w.value for w in shown} == {0.5}


def test_sliders_that_publish(shown):
    lib = library("sheldrake")  # pydrake's calls a method that Drake no longer has
    plant = plant_of(lib)

    class Counter(lib.LeafSystem):
        def __init__(self):
            super().__init__()
            self.count = 0
            self.DeclareForcedPublishEvent(self.publish)

        def publish(self, context):
            self.count += 1

    builder = lib.DiagramBuilder()
    builder.AddSystem(plant)
    counter = builder.AddSystem(Counter())
    diagram = builder.Build()
    context = diagram.CreateDefaultContext()
    seen = []
    hinge = plant.GetJointByName("hinge").position_start()
    slider, *_ = lib.MakeJointSlidersThatPublishOnCallback(
        plant, diagram, context, my_callback=lambda c: seen.append(plant.GetPositions(c)[hinge]), length=100
    )
    assert seen == [0.0]
    before = counter.count
    slider.value = 0.75
    assert seen[-1] == 0.75 and counter.count == before + 1
