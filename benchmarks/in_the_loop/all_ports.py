"""All that a plant with every kind of input says at its ports, in discrete and continuous time, sampled and not."""

import numpy as np
from pydrake.all import (
    AbstractValue,
    AddMultibodyPlantSceneGraph,
    BodyIndex,
    CoulombFriction,
    DiagramBuilder,
    DiscreteContactApproximation,
    ExternallyAppliedSpatialForce,
    HalfSpace,
    LeafSystem,
    Parser,
    PdControllerGains,
    RigidTransform,
    RollPitchYaw,
    Simulator,
    Sine,
    SpatialForce,
)

LINK = """<link name="{name}"><pose>0 0 {z} 0 0 0</pose><inertial><pose>0.02 0 {com} 0 0 0</pose><mass>{mass}</mass>
<inertia><ixx>.02</ixx><iyy>.03</iyy><izz>.025</izz></inertia></inertial>{shape}</link>"""
JOINT = """<joint name="{name}" type="revolute"><parent>{parent}</parent><child>{child}</child><axis><xyz>{axis}</xyz>
<limit><effort>{effort}</effort></limit><dynamics><damping>.1</damping></dynamics></axis></joint>"""
FOOT = '<collision name="foot"><geometry><sphere><radius>.1</radius></sphere></geometry></collision>'
MODEL = "".join(
    [
        '<sdf version="1.9"><model name="stack">',
        LINK.format(name="foot", z=0, com=0, mass=2, shape=FOOT),
        LINK.format(name="leg", z=0.3, com=0.1, mass=1, shape=""),
        LINK.format(name="body", z=0.6, com=0, mass=0.5, shape=""),
        JOINT.format(name="ankle", parent="foot", child="leg", axis="0 1 0", effort=20),
        JOINT.format(name="hip", parent="leg", child="body", axis="1 0 0", effort=3),
        "</model></sdf>",
    ]
)


class Push(LeafSystem):
    def __init__(self, body):
        super().__init__()
        self.body = body
        make = AbstractValue.Make([ExternallyAppliedSpatialForce()])
        self.DeclareAbstractOutputPort("forces", make.Clone, self.calc)

    def calc(self, context, output):
        force = ExternallyAppliedSpatialForce()
        force.body_index, force.p_BoBq_B = self.body, np.array([0.0, 0.1, 0.0])
        force.F_Bq_W = SpatialForce([0.0, 0.1, 0.0], [10.0 * np.sin(30.0 * context.get_time()), 1.0, 2.0])
        output.set_value([force])


def build(time_step, sampled, controlled):
    builder = DiagramBuilder()
    plant, _ = AddMultibodyPlantSceneGraph(builder, time_step)
    (model,) = Parser(plant).AddModelsFromString(MODEL, "sdf")
    if time_step:
        plant.SetUseSampledOutputPorts(sampled)
        plant.set_discrete_contact_approximation(DiscreteContactApproximation.kSap)
    foot = plant.GetBodyByName("foot")
    plant.SetDefaultFloatingBaseBodyPose(foot, RigidTransform(RollPitchYaw(0.1, 0.05, 0.0), [0.0, 0.0, 0.1]))
    if controlled:
        for index in plant.GetJointActuatorIndices():
            plant.get_joint_actuator(index).set_controller_gains(PdControllerGains(p=50, d=5))
        plant.AddDistanceConstraint(foot, [0, 0.3, 0.2], plant.GetBodyByName("body"), [0, 0, 0], 0.55, 1e4, 5.0)
    friction = CoulombFriction(0.6, 0.5)
    plant.RegisterCollisionGeometry(plant.world_body(), RigidTransform(), HalfSpace(), "ground", friction)
    plant.Finalize()
    push = builder.AddSystem(Push(plant.GetBodyByName("leg").index()))
    builder.Connect(push.get_output_port(), plant.get_applied_spatial_force_input_port())
    fed = [(plant.get_actuation_input_port(model), 4.0), (plant.get_applied_generalized_force_input_port(), 1.5)]
    if controlled:
        fed.append((plant.get_desired_state_input_port(model), 0.3))
    for port, amplitude in fed:
        n = port.size()
        source = builder.AddSystem(Sine(np.full(n, amplitude), np.full(n, 20.0), 0.3 * np.arange(n)))
        builder.Connect(source.get_output_port(0), port)
    return builder.Build(), plant


def numbers(value):
    """What a port carries, as numbers; nothing of what has none."""
    if isinstance(value, np.ndarray):
        return value
    if isinstance(value, list):
        return np.array([numbers(one) for one in value])
    if isinstance(value, RigidTransform):
        return value.GetAsMatrix34()
    if hasattr(value, "get_coeffs"):
        return value.get_coeffs()
    if hasattr(value, "num_point_pair_contacts"):
        pairs = [value.point_pair_contact_info(i) for i in range(value.num_point_pair_contacts())]
        return np.array([[*pair.contact_force(), *pair.contact_point(), pair.slip_speed()] for pair in pairs])
    return np.zeros(0)


KINDS = (0.01, True, True), (0.01, False, True), (0.01, True, False), (0, True, False)  # step, sampled, controlled


def program():
    found = []
    for time_step, sampled, controlled in KINDS:
        diagram, plant = build(time_step, sampled, controlled)
        simulator = Simulator(diagram)
        integrator = simulator.get_mutable_integrator()
        integrator.set_fixed_step_mode(True)
        integrator.set_maximum_step_size(0.001)
        for t in (0.0, 0.003, 0.01, 0.0152, 0.04):
            simulator.AdvanceTo(t)
            context = plant.GetMyContextFromRoot(simulator.get_context())
            ports = [plant.get_output_port(k) for k in range(plant.num_output_ports())]
            found += [numbers(p.Eval(context)) for p in ports if not p.get_name().startswith("deformable")]
            bodies = [plant.get_body(BodyIndex(i)) for i in range(plant.num_bodies())]
            found.append(numbers([plant.EvalBodySpatialAccelerationInWorld(context, body) for body in bodies]))
    return found


for _ in range(3):
    program()
