"""ModelVisualizer: what it shows of a file, how the page's sliders and buttons act, and how files are read again."""

import signal
import subprocess
import sys
import threading
import time

import numpy as np
import pytest

import sheldrake
from sheldrake.common.deprecation import DrakeDeprecationWarning
from sheldrake.geometry import Meshcat, Sphere
from sheldrake.math import RotationMatrix
from sheldrake.visualization import ModelVisualizer

ARM = """<robot name='arm'><link name='base'/><joint name='weld' type='fixed'><parent link='world'/>
<child link='base'/></joint><link name='world'/>
<link name='rod'><inertial><mass value='2'/><inertia ixx='.1' iyy='.2' izz='.25' ixy='0' ixz='0' iyz='0'/></inertial>
<visual><geometry><box size='1 1 {size}'/></geometry></visual></link>
<joint name='turn' type='revolute'><axis xyz='0 0 1'/><parent link='base'/><child link='rod'/>
<limit lower='-1' upper='1' effort='1' velocity='1'/></joint></robot>"""


@pytest.fixture
def file(tmp_path):
    path = tmp_path / "arm.urdf"
    path.write_text(ARM.format(size=1))
    return path


def key(meshcat, code):
    meshcat._hub.controls.receive({"type": "key", "code": code})


def box_of(visualizer):
    return visualizer.meshcat()._hub.tree.get("/drake/illustration/arm/rod/arm/Box").object.shape


def test_one_pass_draws_the_model_and_leaves_no_button(file):
    visualizer = ModelVisualizer(visualize_frames=True, triad_length=0.5, environment_map=None)
    visualizer.AddModels(file)
    visualizer.Run(position=[0.5], loop_once=True)
    meshcat = visualizer.meshcat()
    assert meshcat.GetSliderNames() == ["illustration α", "inertia α", "proximity α", "turn"]
    assert meshcat.GetSliderValue("turn") == 0.5 and meshcat.GetButtonNames() == []
    rod = meshcat._hub.tree.get("/drake/illustration/arm/rod").pose
    assert rod[:, :3] == pytest.approx(
        np.array([[np.cos(0.5), -np.sin(0.5), 0], [np.sin(0.5), np.cos(0.5), 0], [0, 0, 1]])
    )
    axis = meshcat._hub.tree.get("/drake/illustration/arm/rod/_frames/rod(2)/x-axis")
    assert axis.object.shape.length() == 0.5 and axis.pose[:, 3] == pytest.approx([0.25, 0, 0])
    assert meshcat.HasPath("inertia/InertiaVisualizer/arm/rod") and meshcat.HasPath("proximity")


def test_a_meshcat_that_was_used_before_is_cleared(file):
    meshcat = Meshcat(port=0)
    meshcat.SetObject("old", Sphere(1))
    meshcat.AddSlider("turn", 0, 1, 0.1, 0)
    for _ in range(2):
        visualizer = ModelVisualizer(meshcat=meshcat)
        assert visualizer.meshcat() is meshcat
        visualizer.AddModels(str(file))
        visualizer.Finalize()
        assert not meshcat.HasPath("old")
        assert meshcat.GetSliderNames() == ["illustration α", "inertia α", "proximity α", "turn"]
        assert meshcat.GetButtonNames() == ["Reload Model Files"]


def run_and(visualizer, act):
    """Runs the visualizer while `act` is done in a thread after the first picture."""
    first = threading.Event()
    publish = visualizer._publish

    def watched():
        publish()
        first.set()

    visualizer._publish = watched
    thread = threading.Thread(target=lambda: (first.wait(60), act()))
    thread.start()
    visualizer.Run()
    thread.join(60)


def test_escape_ends_and_sliders_move(file):
    visualizer = ModelVisualizer()
    visualizer.AddModels(file)
    meshcat = visualizer.meshcat()
    visualizer.Finalize()

    def act():
        meshcat.SetSliderValue("turn", -0.25)
        key(meshcat, "Escape")

    run_and(visualizer, act)
    visualizer.Run(loop_once=True)
    assert visualizer._plant.GetPositions(visualizer._plant_context) == pytest.approx([-0.25])
    assert meshcat.GetButtonNames() == []


def test_reload_reads_the_file_again_and_keeps_sliders(file):
    visualizer = ModelVisualizer()
    visualizer.AddModels(file)
    visualizer.Finalize()
    meshcat = visualizer.meshcat()

    def act():
        meshcat.SetSliderValue("turn", 0.5)
        meshcat.SetSliderValue("illustration α", 0.5)
        file.write_text(ARM.format(size=3))
        meshcat._hub.controls.receive({"type": "button", "name": "Reload Model Files"})
        element = None
        while element is None or element.object.shape.size()[2] != 3:
            time.sleep(0.01)
            element = meshcat._hub.tree.get("/drake/illustration/arm/rod/arm/Box")
        key(meshcat, "Escape")

    run_and(visualizer, act)
    assert box_of(visualizer).size()[2] == 3
    assert meshcat.GetSliderValue("turn") == 0.5 and meshcat.GetSliderValue("illustration α") == 0.5
    assert visualizer._plant.GetPositions(visualizer._plant_context) == pytest.approx([0.5])


def test_a_click_before_run_and_a_click_during_a_reload_are_answered(file, monkeypatch):
    """Whoever clicks then has changed the file since it was read."""
    visualizer = ModelVisualizer()
    visualizer.AddModels(file)
    visualizer.Finalize()
    controls, reload, seen = visualizer.meshcat()._hub.controls, visualizer._reload, []

    def read_slowly():
        reload()
        seen.append(box_of(visualizer).size()[2])
        if len(seen) == 1:
            file.write_text(ARM.format(size=3))
            controls.receive({"type": "button", "name": "Reload Model Files"})

    monkeypatch.setattr(visualizer, "_reload", read_slowly)
    file.write_text(ARM.format(size=2))
    controls.receive({"type": "button", "name": "Reload Model Files"})
    visualizer.Run(loop_once=True)
    assert seen == [2]

    def act():
        while len(seen) < 2:
            time.sleep(0.01)
        key(visualizer.meshcat(), "Escape")

    seen.clear()
    run_and(visualizer, lambda: (controls.receive({"type": "button", "name": "Reload Model Files"}), act()))
    assert seen == [3, 3]


def test_a_file_gone_bad_leaves_the_scene_and_adds_a_traffic_cone(file, caplog):
    visualizer = ModelVisualizer()
    visualizer.AddModels(file)
    visualizer.Finalize()
    before = visualizer.meshcat().GetSliderNames()
    file.write_text("<robot")
    visualizer._reload()
    assert "cannot be reloaded" in caplog.text and "arm.urdf" in caplog.text
    assert box_of(visualizer).size()[2] == 1 and visualizer.meshcat().GetSliderNames() == before
    assert visualizer.meshcat().HasPath("/PARSE_ERROR/cone"), "a traffic cone"
    file.write_text(ARM.format(size=2))
    visualizer._reload()
    assert box_of(visualizer).size()[2] == 2 and not visualizer.meshcat().HasPath("/PARSE_ERROR")


def test_whoever_takes_the_parser_gets_no_reload(file):
    visualizer = ModelVisualizer()
    visualizer.parser().AddModels(str(file))
    visualizer.Finalize()
    assert visualizer.meshcat().GetButtonNames() == []


def test_packages_and_addresses(tmp_path, file):
    (tmp_path / "package.xml").write_text("<package><name>mine</name></package>")
    for add in ({"filename": "package://mine/arm.urdf"}, {"url": "package://mine/arm.urdf"}):
        visualizer = ModelVisualizer()
        visualizer.package_map().AddPackageXml(str(tmp_path / "package.xml"))
        visualizer.AddModels(**add)
        visualizer.Finalize()
        visualizer._reload()
        assert box_of(visualizer).size()[2] == 1


def test_errors(file, tmp_path):
    visualizer = ModelVisualizer()
    for arguments in ({}, {"filename": file, "url": "package://a/b"}):
        with pytest.raises(ValueError, match="Must provide either filename= or url="):
            visualizer.AddModels(**arguments)
    with pytest.raises(RuntimeError, match=r"none\.urdf"):
        visualizer.AddModels(tmp_path / "none.urdf")
    visualizer.AddModels(file)
    with pytest.raises(ValueError, match=r"positions \(2\) does not match the number in the model \(1\)"):
        visualizer.Finalize(position=[1, 2])
    visualizer = ModelVisualizer()
    visualizer.Finalize()
    for call in (visualizer.Finalize, visualizer.parser, visualizer.package_map, lambda: visualizer.AddModels(file)):
        with pytest.raises(ValueError, match="Finalize has already been called"):
            call()
    with pytest.raises(RuntimeError, match="compliance_type"):
        ModelVisualizer(compliance_type="soft")


def test_a_camera_sees_what_the_page_looks_at(file, monkeypatch):
    visualizer = ModelVisualizer(show_rgbd_sensor=True)
    visualizer.AddModels(file)
    visualizer.Finalize()
    preview, context = visualizer._preview, visualizer._context
    assert not preview.look(context, 0) and preview._picture is None, "nobody looks"
    down = RotationMatrix.MakeXRotation(np.pi)
    for height, is_filled in ((2.0, False), (0.8, True)):
        pose = down.ToQuaternion().wxyz(), np.array([0.0, 0.0, height])
        monkeypatch.setattr(visualizer.meshcat()._hub.controls, "newest_camera_pose", lambda pose=pose: pose)
        assert preview.look(context, 0) and not preview.look(context, 0)
        background, middle = preview._picture.image[0, 0], preview._picture.image[180, 240]
        assert bool((background == middle).all()) == is_filled
    assert preview.look(context, 1), "a slider moved"


def test_the_retired_name_still_adds(file):
    visualizer = ModelVisualizer()
    with pytest.warns(DrakeDeprecationWarning, match=r"use AddModels\(\)"):
        visualizer.AddModelFromFile(file)
    visualizer.Finalize()
    assert box_of(visualizer).size()[2] == 1


@pytest.mark.parametrize(
    "command", [["sheldrake", "view", "--once"], ["sheldrake.visualization.model_visualizer", "--loop_once"]]
)
def test_from_the_shell(command, file):
    done = subprocess.run([sys.executable, "-m", *command, str(file)], capture_output=True, text=True, timeout=120)
    assert done.returncode == 0, done.stderr
    wrong = subprocess.run([sys.executable, "-m", *command, "none.urdf"], capture_output=True, text=True, timeout=120)
    assert wrong.returncode == 1 and "none.urdf" in wrong.stderr and "Traceback" not in wrong.stderr


def test_a_mesh_file_can_be_shown():
    visualizer = ModelVisualizer()
    visualizer.AddModels(sheldrake.model_path("two_hole_block/two_hole_block.obj"))
    visualizer.Run(loop_once=True)
    assert visualizer._plant.num_bodies() == 2


@pytest.mark.skipif(sys.platform == "win32", reason="no SIGINT there")
def test_control_c_ends_it_without_a_word(file):
    command = [sys.executable, "-m", "sheldrake", "view", str(file)]
    with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True) as process:
        assert "Ctrl-C" in process.stdout.readline()
        process.send_signal(signal.SIGINT)
        try:
            _, errors = process.communicate(timeout=60)
        finally:
            process.kill()
    assert process.returncode == 0 and "Traceback" not in errors and "Warning" not in errors
