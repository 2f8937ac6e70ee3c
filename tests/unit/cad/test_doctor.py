import shutil

import numpy as np
import pytest
from tests.unit.cad import solids

from sheldrake.cad import DiagnoseModel

BOX_MOMENT = 0.77 / 12.0 * (0.06**2 + 0.04**2)


def write(folder, text, name="robot.urdf"):
    path = folder / name
    path.write_text(text)
    return path


def box_link(name, size="0.1 0.1 0.1", mass=1.0, inertia=None, origin="0 0 0", com="0 0 0"):
    sides = np.array(size.split(), dtype=float)
    moments = inertia or [mass / 12.0 * (sides @ sides - s * s) for s in sides]
    return f"""
  <link name="{name}">
    <inertial><origin xyz="{com}"/><mass value="{mass}"/>
      <inertia ixx="{moments[0]}" iyy="{moments[1]}" izz="{moments[2]}" ixy="0" ixz="0" iyz="0"/></inertial>
    <collision><origin xyz="{origin}"/><geometry><box size="{size}"/></geometry></collision>
  </link>"""


def joint(
    name, parent, child, inside='<limit lower="-1" upper="1" effort="5" velocity="1"/>', kind="revolute", xyz="1 0 0"
):
    return f"""
  <joint name="{name}" type="{kind}"><parent link="{parent}"/><child link="{child}"/><origin xyz="{xyz}"/>
    <axis xyz="0 0 1"/>{inside}</joint>"""


def robot(*parts):
    return '<robot name="r">' + "".join(parts) + "\n</robot>\n"


def codes(diagnosis):
    return {finding.code for finding in diagnosis.findings}


def only(diagnosis, code):
    (finding,) = [f for f in diagnosis.findings if f.code == code]
    return finding


def mended(diagnosis, tmp_path):
    out = tmp_path / "out.urdf"
    diagnosis.WriteFixed(out)
    return DiagnoseModel(out)


def load(path):
    from sheldrake.multibody.parsing import Parser
    from sheldrake.multibody.plant import AddMultibodyPlantSceneGraph
    from sheldrake.systems.framework import DiagramBuilder

    plant, _ = AddMultibodyPlantSceneGraph(DiagramBuilder(), 1e-3)
    Parser(plant).AddModels(str(path))
    plant.Finalize()
    return plant


def test_a_sound_robot_has_no_findings(tmp_path):
    path = write(tmp_path, robot(box_link("a"), box_link("b"), joint("j", "a", "b")))
    assert DiagnoseModel(path).findings == []


def test_the_articles_inertia_is_found_and_mended(tmp_path):
    (tmp_path / "block.obj").write_bytes(solids.obj(*solids.box(60.0, 40.0, 25.0)))
    path = write(
        tmp_path,
        """<robot
  name="slider">
  <link name="body">
    <inertial>
      <mass value="0.77"/>
      <inertia ixx="1" ixy="0.0" ixz="0.0" iyy="1" iyz="0.0" izz="1" />
    </inertial> <!-- stays -->
    <collision>
      <geometry><mesh filename="block.obj" scale="0.001 0.001 0.001"/></geometry>
    </collision>
  </link>
</robot>""",
    )
    diagnosis = DiagnoseModel(path)
    finding = only(diagnosis, "inertia-too-large")
    assert (finding.severity, finding.line, finding.subject) == ("error", 4, "body")
    assert "0.77 kg" in finding.message and "(1, 1, 1" in finding.message and finding.is_fixable
    other = tmp_path / "elsewhere"
    other.mkdir()
    fixed = diagnosis.WriteFixed(other / "fixed.urdf")
    assert finding in fixed
    text = (other / "fixed.urdf").read_text()
    assert "<!-- stays -->" in text and 'filename="../block.obj"' in text
    assert DiagnoseModel(other / "fixed.urdf").findings == []
    M = load(other / "fixed.urdf").GetBodyByName("body").default_spatial_inertia()
    I_BBcm = M.Shift(M.get_com()).CalcRotationalInertia().CopyToFullMatrix3()
    assert I_BBcm[2, 2] == pytest.approx(BOX_MOMENT, rel=1e-8)
    np.testing.assert_allclose(M.get_com(), [0.03, 0.02, 0.0125], rtol=1e-8)


@pytest.mark.parametrize(
    "link, code, severity, fixable",
    [
        (box_link("a", inertia=[1, 1, 5]), "inertia-impossible", "error", True),
        (box_link("a", inertia=[-1, 1, 1]), "inertia-impossible", "error", True),
        (box_link("a", mass=-2.0), "inertia-impossible", "error", False),
        (box_link("a", inertia=[1e-9, 1e-9, 1e-9]), "inertia-unlike-geometry", "warning", True),
        (box_link("a", inertia=[1e-30, 0, 0]), "inertia-zero", "warning", True),
        (box_link("a", com="0.3 0 0"), "com-outside", "warning", True),
        (box_link("a", mass=1000.0), "density-odd", "warning", False),
        (box_link("a", mass=1e-4), "density-odd", "warning", False),
        ('<link name="a"><inertial><mass value="1"/></inertial><visual><geometry><sphere radius="0.1"/></geometry>'
         "</visual></link>", "inertia-zero", "warning", True),
    ],
)  # fmt: skip
def test_bodies(tmp_path, link, code, severity, fixable):
    diagnosis = DiagnoseModel(write(tmp_path, robot(link)))
    finding = only(diagnosis, code)
    assert (finding.severity, finding.is_fixable, finding.subject) == (severity, fixable, "a")
    assert finding.line > 0
    if fixable:
        assert mended(diagnosis, tmp_path).findings == []


def test_bodies_that_never_move_are_notes(tmp_path):
    text = robot(box_link("a", inertia=[1, 1, 1]), joint("j", "world", "a", kind="fixed"))
    assert only(DiagnoseModel(write(tmp_path, text)), "inertia-too-large").severity == "note"


def test_wrong_scale(tmp_path):
    (tmp_path / "part.stl").write_bytes(solids.binary_stl(*solids.box(60.0, 40.0, 25.0)))
    mesh = '<geometry><mesh filename="part.stl"/></geometry>'
    inertial = (
        '<inertial><mass value="0.1"/><inertia ixx="2e-5" iyy="4e-5" izz="4e-5" ixy="0" ixz="0" iyz="0"/></inertial>'
    )
    path = write(
        tmp_path, robot(f'<link name="a">{inertial}<visual>{mesh}</visual><collision>{mesh}</collision></link>')
    )
    diagnosis = DiagnoseModel(path)
    finding = only(diagnosis, "scale-wrong")
    assert finding.severity == "error" and "60 x 40 x 25 m" in finding.message and "0.001" in finding.fix
    after = mended(diagnosis, tmp_path)
    assert "scale-wrong" not in codes(after) and not after.errors()
    assert (tmp_path / "out.urdf").read_text().count('scale="0.001 0.001 0.001"') == 2


def test_all_faults_of_the_text_are_found_at_once(tmp_path):
    text = robot(
        box_link("a"), box_link("b"), box_link("c"), box_link("d"),
        joint("j1", "a", "b", '<limit lower="1" upper="-1" effort="5" velocity="1"/>'),
        joint("j2", "b", "c", '<limit lower="-90" upper="90" effort="0" velocity="1"/>'),
        joint("j2", "c", "dd", ""),
    )  # fmt: skip
    text = text.replace("dd", "dx")
    diagnosis = DiagnoseModel(write(tmp_path, text))
    found = codes(diagnosis)
    assert found >= {
        "limits-reversed",
        "limits-in-degrees",
        "effort-zero",
        "name-twice",
        "limits-absent",
        "name-unknown",
    }
    assert only(diagnosis, "limits-reversed").line == text[: text.index('lower="1"')].count("\n") + 1


def test_text_faults_are_mended(tmp_path):
    text = robot(
        box_link("base"), box_link("arm"), box_link("hand"),
        joint("j1", "base", "arm", '<limit lower="1" upper="-1" effort="5" velocity="1"/>'),
        joint("j1", "arm", "hnd", '<limit lower="-90" upper="90" effort="5" velocity="-1"/>'),
    )  # fmt: skip
    text = text.replace("hnd", "handd")
    diagnosis = DiagnoseModel(write(tmp_path, text))
    assert {f.code for f in diagnosis.errors()} == {
        "limits-reversed",
        "name-twice",
        "name-unknown",
        "velocity-negative",
    }
    assert mended(diagnosis, tmp_path).findings == []
    plant = load(tmp_path / "out.urdf")
    assert plant.GetJointByName("j1").position_upper_limits() == [1.0]
    assert plant.GetJointByName("j1_2").position_upper_limits() == pytest.approx([np.pi / 2])


def test_a_mesh_whose_name_is_misspelt_is_not_thrown_away(tmp_path):
    for name in ("bracket.obj", "base.obj"):
        (tmp_path / name).write_bytes(solids.obj(*solids.box(0.06, 0.04, 0.025)))
    collision = '\n    <collision><geometry><mesh filename="brackett.obj"/></geometry></collision>'
    diagnosis = DiagnoseModel(write(tmp_path, robot(box_link("a").replace("\n  </link>", collision + "\n  </link>"))))
    (finding,) = [f for f in diagnosis.findings if f.code == "mesh-missing"]
    assert finding.fix == "did you mean 'bracket.obj'?"
    assert mended(diagnosis, tmp_path).errors() == []
    assert 'filename="bracket.obj"' in (tmp_path / "out.urdf").read_text()


@pytest.mark.parametrize(("joint", "severity"), [("fixed", "note"), ("floating", "warning")])
def test_what_moves_and_has_no_mass_is_more_than_a_note(tmp_path, joint, severity):
    link = '<link name="a"><collision><geometry><box size="1 1 1"/></geometry></collision></link>'
    text = f"<robot name='r'><link name='world'/>{link}<joint name='j' type='{joint}'><parent link='world'/>"
    path = tmp_path / "robot.urdf"
    path.write_text(text + "<child link='a'/></joint></robot>")
    assert [f.severity for f in DiagnoseModel(path).findings if f.code == "mass-zero"] == [severity]


def test_missing_meshes_are_looked_for(tmp_path):
    (tmp_path / "meshes").mkdir()
    (tmp_path / "meshes" / "Hand.obj").write_bytes(solids.obj(*solids.box(0.06, 0.04, 0.025)))
    visual = '\n    <visual><geometry><mesh filename="{}"/></geometry></visual>'
    link = box_link("a").replace("\n  </link>", visual.format("hand.obj") + visual.format("none.obj") + "\n  </link>")
    diagnosis = DiagnoseModel(write(tmp_path, robot(link)))
    messages = {f.message.split("'")[1]: f for f in diagnosis.findings if f.code == "mesh-missing"}
    assert set(messages) == {"hand.obj", "none.obj"}
    assert "meshes/Hand.obj" in messages["hand.obj"].fix and "remove" in messages["none.obj"].fix
    assert mended(diagnosis, tmp_path).errors() == []
    assert 'filename="meshes/Hand.obj"' in (tmp_path / "out.urdf").read_text()


def test_overlaps_at_rest(tmp_path):
    far = joint("j1", "a", "b", xyz="1 0 0") + joint("j2", "b", "c", xyz="-0.95 0 0")
    diagnosis = DiagnoseModel(write(tmp_path, robot(box_link("a"), box_link("b"), box_link("c"), far)))
    finding = only(diagnosis, "overlap")
    assert finding.subject == "a, c" and finding.severity == "warning" and "0.05 m" in finding.message
    assert mended(diagnosis, tmp_path).findings == []
    touching = far.replace("-0.95", "-0.9")
    assert not DiagnoseModel(write(tmp_path, robot(box_link("a"), box_link("b"), box_link("c"), touching))).findings


def test_sdformat_and_mjcf_too(tmp_path):
    sdf = """<sdf version="1.9"><model name="m">
  <link name="a">
    <inertial><mass>1</mass><inertia><ixx>1</ixx><iyy>1</iyy><izz>1</izz></inertia></inertial>
    <collision name="c"><geometry><box><size>0.1 0.1 0.1</size></box></geometry></collision>
  </link></model></sdf>"""
    diagnosis = DiagnoseModel(write(tmp_path, sdf, "m.sdf"))
    assert only(diagnosis, "inertia-too-large").line == 3
    diagnosis.WriteFixed(tmp_path / "fixed.sdf")
    assert DiagnoseModel(tmp_path / "fixed.sdf").findings == []
    assert load(tmp_path / "fixed.sdf").GetBodyByName("a").default_mass() == 1.0

    mjcf = """<mujoco><worldbody><body name="a" pos="0 0 1"><freejoint/>
    <inertial pos="0 0 0" mass="1" diaginertia="1 1 1"/><geom type="box" size="0.05 0.05 0.05"/>
    </body></worldbody></mujoco>"""
    diagnosis = DiagnoseModel(write(tmp_path, mjcf, "m.xml"))
    finding = only(diagnosis, "inertia-too-large")
    assert finding.line == 1 and not finding.is_fixable
    with pytest.raises(ValueError, match="convert"):
        diagnosis.WriteFixed(tmp_path / "x.xml")


@pytest.mark.parametrize(
    "text, line",
    [
        ("", 1),
        ("<robot", 1),
        ("<robot name='r'>\n<link name='a'>\n</robot>", 3),
        (
            "<robot name='r'><link name='a'/><drake:ball_constraint/></robot>",
            1,
        ),
    ],
)
def test_unreadable_files_are_a_finding(tmp_path, text, line):
    finding = only(DiagnoseModel(write(tmp_path, text)), "unreadable")
    assert finding.severity == "error" and finding.line == line


def test_absent_and_strange_files(tmp_path):
    with pytest.raises(FileNotFoundError):
        DiagnoseModel(tmp_path / "absent.urdf")
    with pytest.raises(ValueError, match="none of"):
        DiagnoseModel(write(tmp_path, "", "model.txt"))


def test_edits_touch_nothing_else(tmp_path):
    text = "  \n" + robot(box_link("ä", inertia=[1, 1, 5]), "\n<!-- <inertial> -- é -->").replace("/>", " />")
    diagnosis = DiagnoseModel(write(tmp_path, text))
    diagnosis.WriteFixed(tmp_path / "out.urdf")
    after = (tmp_path / "out.urdf").read_text()
    start, end = text.index("<inertial>"), text.index("</inertial>")
    assert after.startswith(text[:start]) and after.endswith(text[end:])


def test_the_projects_own_model_is_sound():
    import sheldrake

    assert DiagnoseModel(sheldrake.model_path("two_hole_block/two_hole_block.urdf")).findings == []


def test_command_line(tmp_path, capsys):
    import json

    from sheldrake.cli import main

    path = str(write(tmp_path, robot(box_link("a", inertia=[1, 1, 5]))))
    assert main(["doctor", path]) == 1
    said = capsys.readouterr().out
    assert f"{path}:3:5: error:" in said and "fix:" in said and "1 error, 0 warnings" in said and "--fix FILE" in said
    out = str(tmp_path / "out.urdf")
    assert main(["doctor", path, "--fix", out]) == 0
    assert "fixed 1" in capsys.readouterr().out
    assert main(["doctor", out, "--json"]) == 0
    assert json.loads(capsys.readouterr().out) == []
    assert main(["doctor", str(tmp_path / "absent.urdf")]) == 2
    shutil.rmtree(tmp_path)


def test_edits_know_where_elements_end(tmp_path):
    from sheldrake.cad._xml_edit import XmlSource, apply
    from sheldrake.multibody.parsing import DiagnosticPolicy
    from sheldrake.multibody.parsing._files.xml import parse_xml

    data = b"\n <a x=\"1>2\"><b y='/>'/><c></c><d >t</d ><e\n/></a>"
    source = XmlSource(data, parse_xml(data, "f", DiagnosticPolicy()))
    for child in source.root:
        changed = apply(data, [source.replace(child, "")])
        assert changed.count(b"<") == data.count(b"<") - (1 if child.tag in "be" else 2)
        parse_xml(changed, "f", DiagnosticPolicy())
    edit = source.set_attribute(source.root, "x", '<"&>')
    assert parse_xml(apply(data, [edit]), "f", DiagnosticPolicy()).get("x") == '<"&>'
    edit = source.set_attribute(source.root.find("e"), "z", "3")
    assert parse_xml(apply(data, [edit]), "f", DiagnosticPolicy()).find("e").get("z") == "3"
