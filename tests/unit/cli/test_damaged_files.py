"""Commands on files that came damaged: they do what they are for, or say in words which file is at fault."""

import io
import random
import time

import numpy as np
import pytest
from tests.unit.cad import solids

from sheldrake.cli import main
from sheldrake.geometry._meshes.read_obj import first_fault

Image = pytest.importorskip("PIL.Image")

BOX = solids.box(0.1, 0.1, 0.1)
OBJ = b"mtllib a.mtl\nusemtl m\nvt 0 0\nvt 1 0\nvt 0 1\n" + solids.obj(*BOX)
LINK = """<link name="{0}"><inertial><mass value="1"/>
  <inertia ixx=".01" iyy=".01" izz=".01" ixy="0" ixz="0" iyz="0"/></inertial>
  <visual><geometry><mesh filename="{1}"/></geometry></visual>
  <collision><geometry><mesh filename="{2}"/></geometry></collision></link>
"""
URDF = f"""<robot name="r">
{LINK.format("a", "a.obj", "a.stl")}{LINK.format("b", "a.dae", "a.obj")}
<joint name="j" type="revolute"><parent link="a"/><child link="b"/><origin xyz="0 0 .2"/><axis xyz="0 0 1"/>
  <limit lower="-1" upper="1" effort="1" velocity="1"/></joint>
</robot>"""
SDF = """<sdf version="1.9"><model name="m"><link name="a"><inertial><mass>1</mass></inertial>
<visual name="v"><geometry><mesh><uri>a.obj</uri></mesh></geometry></visual>
<collision name="c"><geometry><mesh><uri>a.stl</uri></mesh></geometry></collision></link></model></sdf>"""
MJCF = """<mujoco model="m"><asset><mesh name="s" file="a.stl"/></asset><worldbody><body name="a"><freejoint/>
<geom type="mesh" mesh="s"/><body name="b" pos="0 0 .2"><joint name="h" axis="0 1 0" range="-90 90"/>
<geom type="capsule" fromto="0 0 0 0 0 .3" size=".02"/></body></body></worldbody>
<actuator><motor joint="h"/></actuator></mujoco>"""
COMMANDS = (
    "view {0} --once",
    "doctor {0}",
    "doctor {0} --json",
    "convert {0} out.sdf",
    "convert {0} out.xml",
    "demo {0} --headless --seconds 0.002",
)
WORDS = (b"-1", b"nan", b"1e999", b"99999999999", b"\xff\xff\xff\x7f", b"<", b'"', b"../", b"\x00")


def picture():
    """A PNG file."""
    stream = io.BytesIO()
    Image.fromarray(np.random.default_rng(0).integers(0, 255, (16, 16, 3), np.uint8)).save(stream, "PNG")
    return stream.getvalue()


def files():
    """What lies in the folder, and which of them a command is given."""
    material = b"newmtl m\nKd 1 1 1\nmap_Kd a.png\n"
    found = {"a.png": picture(), "a.obj": OBJ, "a.mtl": material, "a.stl": solids.binary_stl(*BOX)}
    found["a.dae"] = solids.dae(*BOX)
    return found | {"r.urdf": URDF.encode(), "r.sdf": SDF.encode(), "r.xml": MJCF.encode()}


def damaged(data, chance):
    """A copy that is cut, or has other bits, bytes or words."""
    kind, data = chance.randrange(5), bytearray(data)
    if kind == 0:
        return bytes(data[: chance.randrange(len(data))])
    for _ in range(chance.choice((1, 1, 2, 5, 30))):
        at = chance.randrange(len(data))
        if kind == 1:
            data[at] ^= 1 << chance.randrange(8)
        elif kind == 2:
            data[at] = chance.randrange(256)
        elif kind == 3:
            data[at:at] = chance.choice(WORDS)
        else:
            del data[at : min(at + chance.randrange(1, 40), len(data) - 1)]
    return bytes(data)


def test_no_command_fails_without_naming_a_file(tmp_path, monkeypatch, capfd):
    monkeypatch.chdir(tmp_path)
    whole, chance, failed = files(), random.Random(1), 0
    for name, data in whole.items():
        (tmp_path / name).write_bytes(data)
    for _ in range(60):
        name = chance.choice(list(whole))
        model = name if name.startswith("r.") else chance.choice(("r.urdf", "r.sdf", "r.xml"))
        (tmp_path / name).write_bytes(damaged(whole[name], chance))
        words, begin = chance.choice(COMMANDS).format(model).split(), time.process_time()
        status = main(words)
        assert time.process_time() - begin < 20.0, words  # [s] of the processor; a tenth is usual
        said = "".join(capfd.readouterr())
        assert "Traceback" not in said and status in (0, 1), (words, said)
        assert status == 0 or any(file in said for file in whole), (words, said)
        failed += status
        (tmp_path / name).write_bytes(whole[name])
    assert 10 < failed < 50


def test_what_is_no_line_of_an_obj_file_has_its_number(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    lines = ["v 0 0 0", "v 1 0 0", "v 0 1 0", "vt 0 0", "vt 1 0", "f 1/1 2/2 3/1", "fu1/1 2/2 3/1", "f 1/1 3/1 2/2"]
    (tmp_path / "a.obj").write_text("\n".join(lines))
    (tmp_path / "r.urdf").write_text("<robot name='r'>" + LINK.format("a", "a.obj", "a.obj") + "</robot>")
    assert main(["view", "r.urdf", "--once"]) == 1
    assert "a.obj': line 7 begins with no word of OBJ" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("line", "fault"),
    [
        ("vt 0 x", "line 2 wants numbers after 'vt'"),
        ("f 1/x 2 3", "line 2 wants whole numbers after 'f'"),
        ("password 1", "line 2 begins with no word of OBJ"),
        ("f 1//2 2/1 3", ""),
        ("vn 0 0 1 # up", ""),
    ],
)
def test_the_first_fault_of_an_obj_file(line, fault):
    assert first_fault(f"v 0 0 0\n{line}\ng all\nx\n" if fault else f"v 0 0 0\n{line}\n") == fault


def test_a_mesh_of_points_and_lines_is_no_part(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    far = np.concatenate([BOX[0], [[1e38, 0.0, 0.0]]])
    (tmp_path / "a.stl").write_bytes(solids.binary_stl(far, np.array([[0, 1, 8]])))
    assert main(["mesh2urdf", "a.stl", "--units", "m"]) == 1
    assert "'a.stl' encloses no volume" in capsys.readouterr().err
