"""Model files: what our parser makes of them equals what Drake's parser makes, on the same plant class."""

import importlib
import json
import math
import os
import pathlib
import re
import subprocess
import sys

import pytest

pydrake = pytest.importorskip("pydrake")
pytestmark = pytest.mark.peer

HERE = pathlib.Path(__file__).parent
MODELS = HERE.parents[1] / "models" / "parsing"
SHARE = pathlib.Path(pydrake.__file__).parent / "share" / "drake"
PARTS = ("chain_part.xml", "part.dmd.yaml")  # files that others include
TOLERANCE = 1e-12  # relative to the larger of 1 and the number: a few additions in another order


def compare(cases):
    """(Drake's result, our result) of every case."""
    environment = {**os.environ, "PYTHONPATH": str(HERE.parents[2] / "src")}
    process = subprocess.run(
        [sys.executable, str(HERE / "parsing_on_pydrake.py")],
        input=json.dumps(cases),
        capture_output=True,
        text=True,
        env=environment,
        timeout=600,
    )
    assert process.returncode == 0, process.stderr[-2000:]
    return json.loads(process.stdout)


def differences(theirs, ours, path=""):
    """Where two results differ, as text."""
    if isinstance(theirs, dict) and isinstance(ours, dict):
        keys = (theirs.keys() | ours.keys()) - {"warnings"}
        return [d for key in sorted(keys) for d in differences(theirs.get(key), ours.get(key), f"{path}/{key}")]
    if isinstance(theirs, list) and isinstance(ours, list) and len(theirs) == len(ours):
        return [d for i, (a, b) in enumerate(zip(theirs, ours)) for d in differences(a, b, f"{path}/{i}")]
    if isinstance(theirs, float) and isinstance(ours, float):
        if theirs == ours or math.isclose(theirs, ours, rel_tol=TOLERANCE, abs_tol=TOLERANCE):
            return []
    elif theirs == ours:
        return []
    return [f"{path}: Drake {str(theirs)[:200]}, here {str(ours)[:200]}"]


def files():
    endings = (".urdf", ".sdf", ".xml", ".dmd.yaml", ".obj")
    names = sorted(path for path in MODELS.iterdir() if path.name.endswith(endings))
    own = [path for path in names if path.name not in PARTS]
    drakes = sorted(path for kind in ("urdf", "sdf") for path in SHARE.rglob(f"*.{kind}"))
    return [*own, *drakes]


@pytest.fixture(scope="module")
def file_results():
    packages = {"parsing": str(MODELS)}
    cases = [{"path": str(path), "scene": scene, "packages": packages} for path in files() for scene in (True, False)]
    return dict(zip(((case["path"], case["scene"]) for case in cases), compare(cases)))


@pytest.mark.parametrize("scene", [True, False], ids=["geometry", "bare"])
@pytest.mark.parametrize("path", files(), ids=lambda path: path.name)
def test_files_make_the_same_plant(path, scene, file_results):
    theirs, ours = file_results[str(path), scene]
    assert "error" not in theirs
    assert differences(theirs, ours) == []


LINKS = "".join(
    f'<link name="{name}"><inertial><mass value="2"/><inertia ixx="0.1" iyy="0.2" izz="0.15" ixy="0" ixz="0" iyz="0"/>'
    "</inertial><collision><geometry><sphere radius='0.1'/></geometry></collision></link>"
    for name in "abc"
)


def robot(body):
    return f'<robot name="r" xmlns:drake="http://drake.mit.edu">{body}</robot>'


def inertial(mass, moments, xyz="0 0 0"):
    ixx, iyy, izz = moments
    return robot(
        f'<link name="a"><inertial><origin xyz="{xyz}"/><mass value="{mass}"/>'
        f'<inertia ixx="{ixx}" iyy="{iyy}" izz="{izz}"/></inertial></link>'
    )


def group(name, *content):
    return f'<drake:collision_filter_group name="{name}">{"".join(content)}</drake:collision_filter_group>'


FLOATING_TO_TIP = """directives:
- add_model: {name: one, file: "package://parsing/old.sdf"}
- add_model:
    name: two
    file: package://parsing/old.sdf
    default_free_body_pose:
      a:
        base_frame: one::b
        translation: [1, 2, 3]
"""

MIMIC = (
    LINKS
    + '<joint name="j" type="revolute"><parent link="a"/><child link="b"/></joint><joint name="k" type="prismatic">'
    '<parent link="b"/><child link="c"/><mimic joint="j" multiplier="2" offset="0.1"/></joint>'
)

WELD_WITH_LIMITS = (
    LINKS + '<joint name="j" type="fixed"><parent link="a"/><child link="b"/><limit lower="1" upper="0"/></joint>'
)

DRIVEN_SCREW = (
    LINKS + '<drake:joint name="j" type="screw"><parent link="a"/><child link="b"/><limit effort="2"/>'
    '<drake:screw_thread_pitch value="0.1"/></drake:joint>'
    '<transmission type="SimpleTransmission"><joint name="j"/><actuator name="motor"/></transmission>'
)

HINGES = "".join(f'<body><joint name="j{k}"/><geom size="0.1"/></body>' for k in range(4))

MOTORS_AND_SERVOS = (
    f'<mujoco model="m"><worldbody>{HINGES}</worldbody><actuator><position name="a" joint="j0" kp="2"/>'
    '<motor name="b" joint="j1"/><position joint="j2"/><motor joint="j3"/></actuator></mujoco>'
)


def sdf(body, kind="visual"):
    return f'<sdf version="1.9"><model name="m"><link name="a"><{kind} name="g">{body}</{kind}></link></model></sdf>'


def geom(attributes):
    return f'<mujoco model="m"><worldbody><body name="b"><geom {attributes}/></body></worldbody></mujoco>'


SIZES_LEFT_OUT = ("box", "sphere", "cylinder", "capsule", "ellipsoid", "plane")

MODEL_OF_MODELS = (
    '<sdf version="1.9"><model name="m"><model name="n"><pose>1 2 3 0 0 0</pose><link name="b"/></model>'
    '<frame name="f"/><frame name="g" attached_to="f"/><frame name="h" attached_to="n::b"/>'
    '<frame name="i" attached_to="h"/></model></sdf>'
)
SPHERE = '<geometry><sphere radius="0.1"/></geometry>'

SAME = {
    "frames of a model whose links are another's": {"text": MODEL_OF_MODELS, "type": "sdf"},
    "numbers of a surface that a shape has not": {
        "text": robot(
            f'<link name="a"><collision>{SPHERE}<drake:proximity_properties><drake:hydroelastic_modulus value="-2"/>'
            '<drake:mesh_resolution_hint value="0"/></drake:proximity_properties></collision></link>'
        )
    },
    "looks without a word on whether they are on": {
        "text": robot(f'<link name="a"><visual>{SPHERE}<drake:perception_properties/></visual></link>')
    },
    **{
        f"{tag} without sizes": {"text": sdf(f"<geometry><{tag}/></geometry>"), "type": "sdf"} for tag in SIZES_LEFT_OUT
    },
    "capsule without radius": {
        "text": sdf("<geometry><capsule><length>0.3</length></capsule></geometry>", "collision"),
        "type": "sdf",
    },
    "no inertial": {"text": robot('<link name="a"/>')},
    "inertia breaks the triangle rule": {"text": inertial(1, (1, 1, 10))},
    "negative moment": {"text": inertial(1, (-1, 1, 1), "1 2 3")},
    "inertia without mass": {"text": inertial(0, (1, 1, 1))},
    "negative mass": {"text": inertial(-2, (1, 1, 1), "1 2 3")},
    "point mass": {"text": inertial(2, (0, 0, 0), "1 2 3")},
    "nearly flat": {"text": inertial(1, (1e-6, 1e-6, 2e-6))},
    "renamed copies": {"text": robot(LINKS), "times": 3, "rename": True},
    "prefix": {"text": robot(LINKS), "prefix": "left::arm"},
    "weld that had limits": {"text": robot(WELD_WITH_LIMITS)},
    "mimic": {"text": robot(MIMIC)},
    "effort limit of a screw": {"text": robot(DRIVEN_SCREW)},
    "mimic, continuous time": {"text": robot(MIMIC), "time_step": 0.0},
    "mimic, solver without constraints": {"text": robot(MIMIC), "tamsi": True},
    "groups exclude each other": {
        "text": robot(
            LINKS
            + group("g", '<drake:member link="a"/><drake:ignored_collision_filter_group name="h"/>')
            + group("h", '<drake:member link="b"/><drake:member link="c"/>')
        )
    },
    "motors among position servos": {"text": MOTORS_AND_SERVOS, "type": "xml"},
    "floating on a moving frame": {"text": FLOATING_TO_TIP, "type": "dmd.yaml", "packages": {"parsing": str(MODELS)}},
    "group excludes itself": {
        "text": robot(
            LINKS
            + group(
                "g", '<drake:member link="a"/><drake:member link="b"/><drake:ignored_collision_filter_group name="g"/>'
            )
        )
    },
}


@pytest.fixture(scope="module")
def snippet_results():
    return dict(zip(SAME, compare([{"type": "urdf", **case} for case in SAME.values()])))


@pytest.mark.parametrize("name", SAME)
def test_snippets_make_the_same_plant(name, snippet_results):
    theirs, ours = snippet_results[name]
    assert "error" not in theirs
    assert differences(theirs, ours) == []
    assert len(ours["warnings"]) >= len(theirs["warnings"])


REFUSED = {
    "no such link": '<joint name="j" type="revolute"><parent link="x"/><child link="a"/></joint>',
    "zero axis": '<joint name="j" type="revolute"><parent link="a"/><child link="b"/><axis xyz="0 0 0"/></joint>',
    "no parent": '<joint name="j" type="revolute"><child link="b"/></joint>',
    "unknown type": '<joint name="j" type="hinge"><parent link="a"/><child link="b"/></joint>',
    "limits swapped": '<joint name="j" type="revolute"><parent link="a"/><child link="b"/><limit lower="1" upper="0"/>'
    "</joint>",
    "itself": '<joint name="j" type="revolute"><parent link="a"/><child link="a"/></joint>',
    "same link twice": '<link name="a"/>',
    "not a number": '<link name="d"><inertial><mass value="nan"/></inertial></link>',
    "letters": '<link name="d"><inertial><mass value="heavy"/></inertial></link>',
    "negative damping": '<joint name="j" type="revolute"><parent link="a"/><child link="b"/><dynamics damping="-1"/>'
    "</joint>",
    "negative radius": '<link name="d"><visual><geometry><sphere radius="-1"/></geometry></visual></link>',
    "no such mesh": '<link name="d"><visual><geometry><mesh filename="/no.obj"/></geometry></visual></link>',
    "no such package": '<link name="d"><visual><geometry><mesh filename="package://no/no.obj"/></geometry></visual></link>',
    "no such group": group("g", '<drake:member link="a"/><drake:ignored_collision_filter_group name="h"/>'),
    "no such member": group("g", '<drake:member link="nobody"/>'),
    "empty group": group("g"),
    "transmission of nothing": "<transmission><type>SimpleTransmission</type></transmission>",
    "loop joint": "<loop_joint/>",
}


def test_what_drake_refuses_is_refused_with_a_place():
    cases = [{"text": robot(LINKS + "\n" + body), "type": "urdf"} for body in REFUSED.values()]
    for name, (theirs, ours) in zip(REFUSED, compare(cases)):
        assert "error" in theirs, name
        assert ours.get("error", "").startswith("ParseError: <literal-string>.urdf:"), (name, ours.get("error"))


COMPLETE = """<sdf version="1.9"><model name="m">
<link name="a"><inertial><mass>1</mass><inertia><ixx>1</ixx><iyy>1</iyy><izz>1</izz></inertia></inertial>
<visual name="v"><geometry><box><size>1 1 1</size></box></geometry>
<material><diffuse>1 0 0 1</diffuse></material></visual>
<collision name="c"><geometry><sphere><radius>1</radius></sphere></geometry>
<surface><friction></friction></surface>
<drake:proximity_properties><drake:mesh_resolution_hint>1</drake:mesh_resolution_hint></drake:proximity_properties>
</collision></link><link name="b"/>
<joint name="j" type="revolute"><parent>a</parent><child>b</child><axis><xyz>0 0 1</xyz>
<limit><lower>-1</lower></limit><dynamics><damping>1</damping></dynamics></axis></joint>
</model></sdf>"""
EXTENDED = ("sdf", "model", "link", "visual", "collision", "geometry", "material", "joint", "limit")
DEFINED = (*EXTENDED, "inertial", "inertia", "box", "sphere", "surface", "friction", "axis", "dynamics")


LEAVES = ("mass", "ixx", "size", "diffuse", "radius", "parent", "child", "xyz", "lower", "damping")


def complete_with_attribute(tag, attribute):
    """The complete model with another attribute of one of its elements."""
    return re.sub(rf"<{tag}(?=[ >])", lambda opening: f'{opening[0]} {attribute}="1"', COMPLETE, count=1)


def complete_with(tag, child):
    """The complete model with another element as the first in one."""
    return re.sub(rf"<{tag}( [^>]*)?>", lambda opening: opening[0] + child, COMPLETE, count=1)


OTHERS_REFUSED = {
    "capsule of Drake's without radius": ("sdf", sdf("<geometry><drake:capsule/></geometry>")),
    "ellipsoid of Drake's without axes": ("sdf", sdf("<geometry><drake:ellipsoid/></geometry>")),
    **{f"typo in {tag}": ("sdf", complete_with(tag, "<bogus/>")) for tag in DEFINED},
    **{f"attribute of {tag}": ("sdf", complete_with_attribute(tag, "bogus")) for tag in (*DEFINED, *LEAVES)},
    **{f"extension in {tag}": ("sdf", complete_with(tag, "<drake:bogus/>")) for tag in EXTENDED},
    "reserved name of a link": ("sdf", COMPLETE.replace('name="b"', 'name="__b__"').replace(">b<", ">__b__<")),
    "reserved name of a joint": ("sdf", COMPLETE.replace('name="j"', 'name="____"')),
    "mesh without asset": ("xml", geom('type="mesh"')),
    "signed distance field": ("xml", geom('type="sdf"')),
}


def test_what_drake_refuses_of_other_formats_is_refused():
    cases = [{"text": text, "type": kind} for kind, text in OTHERS_REFUSED.values()]
    for name, (theirs, ours) in zip(OTHERS_REFUSED, compare(cases)):
        assert "error" in theirs, name
        assert ours.get("error", "").startswith("ParseError: "), (name, ours.get("error"))


def test_elements_of_others_and_undefined_extensions_in_plain_elements_are_no_faults():
    texts = [COMPLETE]
    texts += [complete_with(tag, "<gz:bogus/>") for tag in ("model", "link", "box", "inertial", "axis")]
    texts += [complete_with_attribute(tag, "gz:bogus") for tag in ("model", "link", "box", "mass", "xyz")]
    texts += [complete_with(tag, "<drake:bogus/>") for tag in ("box", "inertial", "axis", "surface")]
    for text, (theirs, ours) in zip(texts, compare([{"text": text, "type": "sdf"} for text in texts])):
        assert "error" not in theirs and "error" not in ours, text
        assert differences(theirs, ours) == []


def test_the_comparison_sees_a_fault_of_one_part_in_a_hundred_million():
    right = {"text": inertial(2, (0.1, 0.2, 0.15)), "type": "urdf"}
    wrong = {**right, "text": inertial(2 * (1 + 1e-8), (0.1, 0.2, 0.15)), "theirs": right}
    [(theirs, ours)] = compare([wrong])
    assert any("/bodies/" in difference for difference in differences(theirs, ours))
    assert any("/dynamics/" in difference for difference in differences(theirs, ours))


TAGS = {
    "robot": ("gazebo", "sensor", "bogus", "xacro:macro", "drake:unheard_of"),
    "link": ("self_collide", "contact", "drake:unheard_of"),
    "joint": ("safety_controller", "calibration", "hardwareInterface", "physics"),
}


def test_strict_parsing_refuses_the_same_tags():
    joint = '<joint name="j" type="revolute"><parent link="a"/><child link="b"/>{}</joint>'
    texts = [robot(LINKS + joint.format("") + f"<{tag}/>") for tag in TAGS["robot"]]
    texts += [robot(LINKS + f'<link name="d"><{tag}/></link>') for tag in TAGS["link"]]
    texts += [robot(LINKS + joint.format(f"<{tag}/>")) for tag in TAGS["joint"]]
    for text, (theirs, ours) in zip(texts, compare([{"text": t, "type": "urdf", "strict": True} for t in texts])):
        assert ("error" in theirs) == ("error" in ours), text[-120:]


SDF_TAGS = {
    "model": (
        "self_collide", "allow_auto_disable", "enable_wind", "plugin name='p' filename='f'", "frame name='f'",
    ),
    "world": (
        "audio", "wind", "gravity", "magnetic_field", "atmosphere type='adiabatic'", "gui", "physics type='ode'",
        "scene", "light name='l' type='point'", "state world_name='w'", "frame name='f'",
    ),
    "link": ("enable_wind", "must_be_base_link", "pose"),
    "joint": ("physics", "pose"),
}  # fmt: skip


def test_strict_parsing_refuses_the_same_tags_of_sdformat():
    model = '<model name="m">{model}<link name="a">{link}</link><joint name="j" type="fixed"><parent>world</parent>'
    model += "<child>a</child>{joint}</joint></model>"
    texts = []
    for place, tags in SDF_TAGS.items():
        for tag in tags:
            parts = dict.fromkeys(SDF_TAGS, "") | {place: f"<{tag}/>"}
            texts.append(f'<sdf version="1.9"><world name="w">{parts["world"]}{model.format(**parts)}</world></sdf>')
    refused = 0
    for text, (theirs, ours) in zip(texts, compare([{"text": t, "type": "sdf", "strict": True} for t in texts])):
        assert ("error" in theirs) == ("error" in ours), text
        refused += "error" in theirs
    assert 10 < refused < len(texts)


FRAMES = """directives:
- add_model_instance: {name: sub}
- add_frame: {name: f1, X_PF: {base_frame: 'sub::a'}}
- add_frame: {name: f2, X_PF: {base_frame: world}}
- add_frame: {name: 'sub::f3', X_PF: {base_frame: world}}
- add_frame: {name: f4, X_PF: {base_frame: f2}}
- add_frame: {name: f5, X_PF: {base_frame: 'x::y::z'}}
"""


@pytest.mark.parametrize("namespace", [None, "", ", model_namespace: q"])
def test_frames_of_flattened_directives_have_the_same_names(tmp_path, namespace):
    (tmp_path / "frames.dmd.yaml").write_text(FRAMES)
    file = tmp_path / "frames.dmd.yaml"
    if namespace is not None:
        file = tmp_path / "outer.dmd.yaml"
        inner = f"file://{tmp_path}/frames.dmd.yaml"
        file.write_text(f"directives:\n- add_directives: {{file: {inner!r}{namespace}}}\n")
    found = []
    for name in ("sheldrake", "pydrake"):
        m = importlib.import_module(f"{name}.multibody.parsing")
        flat = m.FlattenModelDirectives(m.LoadModelDirectives(str(file)), m.PackageMap())
        frames = [directive.add_frame for directive in flat.directives if directive.add_frame]
        found.append([(frame.name, frame.X_PF.base_frame) for frame in frames])
    assert found[0] == found[1] and len(found[0]) == 5


def test_the_same_instances_are_returned(tmp_path):
    (tmp_path / "part.urdf").write_text(robot(LINKS))
    include = f"<include><uri>{tmp_path}/part.urdf</uri><name>part</name></include>"
    model = '<model name="{}"><link name="e"/>{}</model>'
    bodies = [
        f'<world name="w">{include}{model.format("m", "")}</world>',
        f'<world name="w">{model.format("m", model.format("n", ""))}</world>',
        model.format("m", include),
    ]
    cases = [{"text": f'<sdf version="1.9">{body}</sdf>', "type": "sdf"} for body in bodies]
    for theirs, ours in compare(cases):
        assert "error" not in theirs and differences(theirs, ours) == []


TRANSLATIONS = ("[1, 2, 3]", "!DeterministicVector {value: [1, 2, 3]}", "[!Deterministic {value: 1}, 2, 3]", "[1, 2]")
ROTATIONS = (
    "!Rpy {deg: !DeterministicVector {value: [10, 20, 30]}}",
    "!Rpy {}",
    "!AngleAxis {angle_deg: !Deterministic {value: 30}, axis: !DeterministicVector {value: [0, 3, 4]}}",
    "!AngleAxis {angle_deg: 30}",
    "!AngleAxis {axis: [1, 0, 0]}",
    "!Identity {deg: [1, 2, 3]}",
)


@pytest.mark.parametrize("rotation", ROTATIONS)
@pytest.mark.parametrize("translation", TRANSLATIONS)
def test_numbers_of_directives_that_are_left_out_or_said_to_be_sure(translation, rotation):
    frame = f"X_PF: {{base_frame: world, translation: {translation}, rotation: {rotation}}}"
    poses = []
    for lib in ("pydrake.multibody", "sheldrake.multibody"):
        plant = importlib.import_module(f"{lib}.plant").MultibodyPlant(0.0)
        parser = importlib.import_module(f"{lib}.parsing").Parser(plant)
        try:
            parser.AddModelsFromString(f"directives:\n- add_frame: {{name: f, {frame}}}\n", "dmd.yaml")
        except RuntimeError:
            poses.append("refused")
            continue
        plant.Finalize()
        pose = plant.GetFrameByName("f").CalcPoseInWorld(plant.CreateDefaultContext())
        poses.append(pose.GetAsMatrix34().round(12).tolist())
    assert poses[0] == poses[1]


P = "<pose>1 2 3 0.1 0.2 0.3</pose>"
IN_OLD_WORLDS = {
    "one": f'<link name="u::a">{P}</link><link name="u::b"/>',
    "another outside": f'<link name="a"/><link name="u::b">{P}</link>',
    "deep": f'<link name="u::w::a">{P}</link><link name="u::b"/>',
    "joint": f'<link name="u::a"/><link name="u::b">{P}</link><joint name="u::j" type="revolute">{P}'
    "<parent>u::a</parent><child>u::b</child><axis><xyz>0 0 1</xyz></axis></joint>",
    "frames": f'<link name="u::a">{P}</link><frame name="u::f" attached_to="u::a">{P}</frame>'
    f'<frame name="g" attached_to="u::f">{P}</frame>',
    "relative pose": f'<link name="u::a">{P}</link>'
    '<link name="u::b"><pose relative_to="u::a">0 0 5 0 0 0</pose></link>',
    "placed model": f'{P}<link name="u::a">{P}</link><link name="b"/>',
    "nested model": f'<link name="u::a"/><model name="u::q"><link name="a"/>{P}</model>',
}


@pytest.mark.parametrize("content", IN_OLD_WORLDS.values(), ids=IN_OLD_WORLDS)
def test_scoped_names_in_old_worlds_are_of_nested_models(content):
    world = f'<world name="w"><model name="m">{content}</model></world>'
    (theirs, ours), newer = compare(
        [{"text": f'<sdf version="{version}">{world}</sdf>', "type": "sdf"} for version in ("1.7", "1.8")]
    )
    assert "error" not in theirs and differences(theirs, ours) == []
    assert all("error" in result for result in newer)
