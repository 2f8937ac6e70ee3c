"""A model in the page: sliders, reload, and Escape by real keys and clicks."""

import threading

from chromium import until
from test_meshcat_page import READY

from sheldrake.visualization import ModelVisualizer

ARM = """<robot name='arm'><link name='base'><visual><geometry><cylinder radius='.1' length='.1'/></geometry></visual>
</link><link name='world'/><joint name='weld' type='fixed'><parent link='world'/><child link='base'/></joint>
<link name='rod'><inertial><origin xyz='.25 0 .1'/><mass value='2'/>
<inertia ixx='.001' iyy='.02' izz='.02' ixy='0' ixz='0' iyz='0'/></inertial>
<visual><origin xyz='.25 0 .1'/><geometry><box size='.5 .05 .05'/></geometry><material name='m'>
<color rgba='.2 .5 .8 1'/></material></visual>
<collision><origin xyz='.25 0 .1'/><geometry><box size='.5 .05 .05'/></geometry></collision></link>
<joint name='lift' type='prismatic'><axis xyz='0 0 1'/><parent link='base'/><child link='rod'/>
<limit lower='{low}' upper='0.5' effort='1' velocity='1'/></joint></robot>"""
ROD = "/drake/illustration/arm/rod"


def button(text):
    return f"[...document.querySelectorAll('button')].find((b) => b.textContent.trim() === {text!r})"


def test_a_person_moves_reloads_and_ends(chromium, tmp_path, pictures):
    file = tmp_path / "arm.urdf"
    file.write_text(ARM.format(low=-0.5))
    visualizer = ModelVisualizer(visualize_frames=True, triad_length=0.1, triad_radius=0.004)
    visualizer.AddModels(file)
    meshcat = visualizer.meshcat()
    visualizer.Finalize([0.1])
    running = threading.Thread(target=visualizer.Run, daemon=True)
    running.start()
    page = chromium.open(meshcat.web_url())
    page.wait_for(READY)
    page.wait_until_at(ROD, [0, 0, 0.1])
    meshcat.SetSliderValue("lift", 0.3)
    page.wait_until_at(ROD, [0, 0, 0.3])
    meshcat.SetProperty("inertia", "visible", True)
    page.screenshot(pictures, "model-visualizer.png")
    file.write_text(ARM.format(low=0.0))
    page.click_on(button("Reload Model Files"))
    until(lambda: meshcat.HasPath(ROD) and visualizer._plant.GetPositionLowerLimits()[0] == 0.0)
    page.wait_until_at(ROD, [0, 0, 0.3])
    page.wait_for(f"!!{button('Stop Running')}")
    page.press("Escape", "Escape")
    running.join(60)
    assert not running.is_alive() and meshcat.GetButtonNames() == []
    assert page.console() == []


def test_the_panel_shows_what_a_camera_would_see(chromium, tmp_path, pictures):
    file = tmp_path / "arm.urdf"
    file.write_text(ARM.format(low=-0.5))
    visualizer = ModelVisualizer(show_rgbd_sensor=True)
    visualizer.AddModels(file)
    meshcat = visualizer.meshcat()
    visualizer.Finalize([0.1])
    meshcat.SetCameraPose([1.2, -0.8, 0.7], [0.2, 0.0, 0.1])
    running = threading.Thread(target=visualizer.Run, daemon=True)
    running.start()
    page = chromium.open(meshcat.web_url())
    page.wait_for(READY)
    image = 'document.querySelector(\'img[src^="blob:"], img[src^="data:image/jpeg"]\')'
    page.wait_for(f"!!{image} && {image}.naturalWidth === 480")
    before = page.evaluate(f"{image}.src")
    meshcat.SetSliderValue("lift", 0.3)
    page.wait_for(f"{image}.src !== {before!r}")
    page.screenshot(pictures, "camera-preview.png")
    page.press("Escape", "Escape")
    running.join(60)
    assert not running.is_alive() and page.console() == []
