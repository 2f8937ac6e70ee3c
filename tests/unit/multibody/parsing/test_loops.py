"""Joints of SDFormat models that close loops, and gearboxes."""

import numpy as np
import pytest

from sheldrake.multibody.parsing import ParseError, Parser
from sheldrake.multibody.plant import MultibodyPlant
from sheldrake.systems.analysis import Simulator

pytestmark = pytest.mark.usefixtures("quiet")

ROD = """<link name="{name}"><pose>{x} 0 {z} 0 0 0</pose><inertial><mass>{mass}</mass><inertia><ixx>0.02</ixx>
<iyy>0.02</iyy><izz>0.02</izz><ixy>0</ixy><ixz>0</ixz><iyz>0</iyz></inertia></inertial></link>"""
HINGE = """<joint name="{name}" type="{kind}"><pose relative_to="__model__">{x} 0 {z} 0 0 0</pose>
<parent>{parent}</parent><child>{child}</child><axis><xyz>0 1 0</xyz></axis></joint>"""


def parallelogram(kind="revolute", mass=1.0):
    """Two rods of 1 m hang from the world, 0.4 m apart; a bar connects their ends."""
    return (
        '<sdf version="1.9"><model name="swing">'
        + ROD.format(name="left", x=0, z=-0.5, mass=1.0)
        + ROD.format(name="right", x=0.4, z=-0.5, mass=1.0)
        + ROD.format(name="bar", x=0.2, z=-1.0, mass=mass)
        + HINGE.format(name="a", kind="revolute", x=0, z=0, parent="world", child="left")
        + HINGE.format(name="b", kind="revolute", x=0.4, z=0, parent="world", child="right")
        + HINGE.format(name="c", kind="revolute", x=0, z=-1, parent="left", child="bar")
        + HINGE.format(name="d", kind=kind, x=0.4, z=-1, parent="right", child="bar")
        + "</model></sdf>"
    )


def make(text, time_step=1e-3):
    plant = MultibodyPlant(time_step)
    Parser(plant).AddModelsFromString(text, "sdf")
    plant.Finalize()
    return plant


@pytest.mark.parametrize("kind", ["revolute", "ball"])
def test_a_parallelogram_swings_as_one_pendulum(kind):
    plant = make(parallelogram(kind), time_step=1e-4)
    assert (plant.num_bodies(), plant.num_constraints()) == (5, 1)
    simulator = Simulator(plant)
    context = simulator.get_mutable_context()
    assert plant.CalcTotalMass(context) == pytest.approx(3.0, rel=1e-15)
    lean = 1e-3
    for name, angle in (("a", lean), ("b", lean), ("c", -lean)):
        plant.GetJointByName(name).set_angle(context, angle)
    if kind == "revolute":
        plant.GetJointByName("d").set_angle(context, -lean)
    else:
        plant.GetJointByName("d").set_angles(context, [0.0, -lean, 0.0])
    # Moment of inertia about the hinges: rods 2 (0.02 + 0.5²), the bar moves like a point; weight at 0.5, 0.5 and 1 m.
    rate = np.sqrt(9.81 * (0.5 + 0.5 + 1.0) / (2 * (0.02 + 0.25) + 1.0))
    simulator.AdvanceTo(0.5 * np.pi / rate)  # a quarter of a period
    a, b = (plant.GetJointByName(name) for name in "ab")
    assert abs(a.get_angle(context)) < 2e-4 * rate * lean  # two steps
    assert a.get_angular_rate(context) == pytest.approx(-lean * rate, rel=1e-3)
    assert a.get_angle(context) == pytest.approx(b.get_angle(context), abs=1e-5 * lean)


def test_a_loop_of_links_without_mass_is_refused():
    with pytest.raises(ParseError, match="'d' closes a kinematic loop"):
        make(parallelogram(mass=0.0).replace("0.02", "0"))


def test_a_loop_between_the_models_of_a_world_is_refused():
    model = '<model name="m"><link name="a"/></model>'
    joint = '<joint name="{}" type="fixed"><parent>world</parent><child>m::a</child></joint>'
    with pytest.raises(ParseError, match=r"'d' closes a kinematic loop.* a world has no links at which"):
        make(f'<sdf version="1.9"><world name="w">{model}{joint.format("c")}{joint.format("d")}</world></sdf>')


GEARS = """<sdf version="1.9"><model name="gears">{rods}{joints}
<joint name="gear" type="gearbox"><parent>motor</parent><child>wheel</child>{reference}
<gearbox_ratio>0.25</gearbox_ratio><axis><xyz>0 1 0</xyz></axis></joint></model></sdf>"""
RODS = "".join(ROD.format(name=name, x=0, z=0, mass=1.0) for name in ("base", "motor", "wheel"))
TURNS = HINGE.format(name="fast", kind="revolute", x=0, z=0, parent="base", child="motor")
REFERENCE = "<gearbox_reference_body>base</gearbox_reference_body>"


@pytest.mark.parametrize("backwards", [False, True])
def test_a_gearbox_couples_two_joints(backwards):
    ends = dict(parent="wheel", child="base") if backwards else dict(parent="base", child="wheel")
    slow = HINGE.format(name="slow", kind="revolute", x=0, z=0, **ends)
    plant = make(GEARS.format(rods=RODS, joints=TURNS + slow, reference=REFERENCE))
    assert plant.num_constraints() == 1
    simulator = Simulator(plant)
    context = simulator.get_mutable_context()
    fast, slow = (plant.GetJointByName(name) for name in ("fast", "slow"))
    plant.get_actuation_input_port().FixValue(context, [0.3, 0.0])
    simulator.AdvanceTo(0.2)
    assert abs(fast.get_angle(context)) > 0.1
    sign = 1.0 if backwards else -1.0
    assert slow.get_angle(context) == pytest.approx(sign * 0.25 * fast.get_angle(context), rel=1e-6)


@pytest.mark.parametrize(
    "joints, reference, problem",
    [
        (TURNS, "", "no <gearbox_reference_body>"),
        (TURNS, REFERENCE, "needs a revolute joint between its reference body 'base' and 'wheel'"),
        (
            TURNS
            + HINGE.format(name="slow", kind="revolute", x=0, z=0, parent="base", child="wheel").replace(
                "0 1 0<", "1 0 0<"
            ),
            REFERENCE,
            "is not that of joint 'slow'",
        ),
    ],
)
def test_gearboxes_that_couple_nothing_are_refused(joints, reference, problem):
    with pytest.raises(ParseError, match=problem):
        make(GEARS.format(rods=RODS, joints=joints, reference=reference))
