"""Programs as people write them, run with both libraries: what they would print is the same."""

import importlib
import types

import numpy as np
import pytest

pytest.importorskip("pydrake")
pytestmark = pytest.mark.peer

LIBRARIES = [importlib.import_module(f"{name}.all") for name in ("sheldrake", "pydrake")]

LINK = """
<link name="link{i}"><inertial><origin xyz="0 0 0.15"/><mass value="{mass}"/>
    <inertia ixx="0.03" iyy="0.03" izz="0.01" ixy="0" ixz="0" iyz="0"/></inertial>
  <collision><origin xyz="0 0 0.15"/><geometry><sphere radius="0.06"/></geometry></collision></link>
<joint name="j{i}" type="revolute"><parent link="{parent}"/><child link="link{i}"/><origin xyz="0 0 0.3"/>
  <axis xyz="{axis}"/><limit lower="-2.5" upper="2.5" effort="100"/><dynamics damping="0.5"/></joint>
<transmission><type>transmission_interface/SimpleTransmission</type><joint name="j{i}"/>
  <actuator name="j{i}"/></transmission>
"""


def arm(name, links=4):
    text = f'<robot name="{name}"><link name="base"/>'
    for i in range(links):
        parent, axis = f"link{i - 1}" if i else "base", "0 1 0" if i % 2 else "0 0 1"
        text += LINK.format(i=i, mass=3.0 - 0.5 * i, parent=parent, axis=axis)
    return text + "</robot>"


def add_arm(m, plant, parser, name, x):
    (instance,) = parser.AddModelsFromString(arm(name), "urdf")
    base = plant.GetFrameByName("base", instance)
    plant.WeldFrames(plant.world_frame(), base, m.RigidTransform([x, 0.0, 0.0]))
    return instance


def random_tree(m):
    """An RRT of one's own around a post, and its path made shorter."""
    builder = m.RobotDiagramBuilder(time_step=0.0)
    plant = builder.plant()
    instance = add_arm(m, plant, builder.parser(), "arm", 0.0)
    friction = m.CoulombFriction(1.0, 1.0)
    X_WPost = m.RigidTransform([0.5, 0.0, 0.6])
    plant.RegisterCollisionGeometry(plant.world_body(), X_WPost, m.Box(0.15, 0.15, 0.9), "post", friction)
    plant.Finalize()
    checker = m.SceneGraphCollisionChecker(
        model=builder.Build(), robot_model_instances=[instance], edge_step_size=0.05, env_collision_padding=0.01
    )
    start, goal = np.array([0.9, 1.2, 0.0, 0.4]), np.array([-0.9, 1.2, 0.0, 0.4])
    rng = np.random.default_rng(3)
    nodes, parents = [start], [-1]
    for k in range(300):
        q = goal if k % 8 == 0 else rng.uniform(-1.2, 1.2, 4)
        nearest = int(np.argmin(np.linalg.norm(np.array(nodes) - q, axis=1)))
        way = q - nodes[nearest]
        if np.linalg.norm(way) < 1e-9:
            break
        new = nodes[nearest] + way * np.minimum(1.0, 0.4 / np.linalg.norm(way))
        if checker.CheckEdgeCollisionFree(nodes[nearest], new):
            nodes.append(new)
            parents.append(nearest)
    path, at = [], len(nodes) - 1
    while at >= 0:
        path.append(nodes[at])
        at = parents[at]
    clearance = [np.sort(checker.CalcRobotClearance(q, 0.4).distances())[:2] for q in path]
    kept = [path[0]]
    while not np.array_equal(kept[-1], path[-1]):
        first = next(k for k, q in enumerate(path) if np.array_equal(q, kept[-1]))
        kept.append(next(q for q in path[:first:-1] if checker.CheckEdgeCollisionFree(kept[-1], q)))
    assert len(path) > 3, "the tree has grown"
    return [len(nodes), len(path), *np.concatenate(clearance), *np.concatenate(kept)]


def two_arms_and_a_linkage(m):
    """Arms with PD control and torques by instance, and bodies held by every kind of constraint."""
    builder = m.DiagramBuilder()
    plant, _ = m.AddMultibodyPlantSceneGraph(builder, time_step=2e-3)
    plant.set_discrete_contact_approximation(m.DiscreteContactApproximation.kSap)
    parser = m.Parser(plant)
    left, right = add_arm(m, plant, parser, "left", 0.0), add_arm(m, plant, parser, "right", 1.5)
    for name in ("j0", "j1", "j2", "j3"):
        gains = m.PdControllerGains(p=100.0, d=10.0)
        plant.GetJointActuatorByName(name, left).set_controller_gains(gains)
    linkage = plant.AddModelInstance("linkage")
    inertia = m.SpatialInertia.SolidBoxWithMass(1.0, 0.5, 0.05, 0.05)
    a, b, c, ball, weight = (plant.AddRigidBody(n, linkage, inertia) for n in ("a", "b", "c", "ball", "weight"))
    beside = plant.AddFrame(m.FixedOffsetFrame("beside", plant.world_frame(), m.RigidTransform([0, 1, 0])))
    ja = plant.AddJoint(m.RevoluteJoint("ja", plant.world_frame(), a.body_frame(), [0, 1, 0]))
    jb = plant.AddJoint(m.RevoluteJoint("jb", beside, b.body_frame(), [0, 1, 0]))
    plant.AddJoint(m.PrismaticJoint("jc", plant.world_frame(), c.body_frame(), [0, 0, 1])).set_default_translation(
        -0.45
    )
    plant.AddCouplerConstraint(ja, jb, gear_ratio=-2.0, offset=0.3)
    plant.AddDistanceConstraint(
        body_A=a, p_AP=[0.2, 0, 0], body_B=c, p_BQ=[0, 0, 0], distance=0.4, stiffness=1e5, damping=100.0
    )
    plant.AddBallConstraint(body_A=b, p_AP=[0.25, 0, 0], body_B=ball, p_BQ=[0, 0, 0.1])
    X_BallWeight = m.RigidTransform([0, 0, -0.1])
    plant.AddWeldConstraint(body_A=ball, X_AP=X_BallWeight, body_B=weight, X_BQ=m.RigidTransform())
    plant.SetDefaultFloatingBaseBodyPose(ball, m.RigidTransform([0.25, 1, -0.1]))
    plant.SetDefaultFloatingBaseBodyPose(weight, m.RigidTransform([0.25, 1, -0.2]))
    ja.set_default_angle(0.15)
    plant.Finalize()
    simulator = m.Simulator(builder.Build())
    context = plant.GetMyMutableContextFromRoot(simulator.get_mutable_context())
    plant.get_desired_state_input_port(left).FixValue(context, [0.3, 0.4, -0.2, 0.1, 0, 0, 0, 0])
    plant.get_actuation_input_port(left).FixValue(context, [0, 0, 0.5, 0])
    plant.get_actuation_input_port(right).FixValue(context, [1, -2, 0.3, 0.1])
    found = []
    for t in (0.1, 0.3, 0.5):
        simulator.AdvanceTo(t)
        found += [plant.GetPositionsAndVelocities(context, instance) for instance in (left, right, linkage)]
        found.append(plant.get_net_actuation_output_port(left).Eval(context))
        found.append(plant.EvalBodyPoseInWorld(context, weight).translation())
    return np.concatenate(found)


def slow_eyes_and_quick_hands(m):
    """Perception ten times a second that a quick loop asks all the time: what it said, and how often it was called."""
    calls = dict.fromkeys(("state", "input", "entry", "everything"), 0)

    class Eyes(m.LeafSystem):
        def __init__(self):
            super().__init__()
            self.u = self.DeclareVectorInputPort("u", 1)
            seen = self.DeclareAbstractState(m.Value([0.0]))
            self.DeclarePeriodicUnrestrictedUpdateEvent(0.1, 0.0, self.look)
            named = {self.abstract_state_ticket(seen)}
            self.DeclareVectorOutputPort("a", 1, lambda c, y: self.say("state", c, y), named)
            self.DeclareVectorOutputPort("b", 1, lambda c, y: self.follow(c, y), {self.u.ticket()})
            entry = m.ValueProducer(lambda: m.Value([0.0]), self.keep)
            self.entry = self.DeclareCacheEntry("seen", entry, named)
            self.DeclareVectorOutputPort("c", 1, lambda c, y: y.SetFromVector(self.entry.Eval(c)))
            self.DeclareVectorOutputPort("d", 1, lambda c, y: self.say("everything", c, y))

        def look(self, context, state):
            state.get_mutable_abstract_state(0).set_value([context.get_time()])

        def say(self, what, context, output):
            calls[what] += 1
            output.SetFromVector(context.get_abstract_state(0).get_value())

        def follow(self, context, output):
            calls["input"] += 1
            output.SetFromVector(self.u.Eval(context))

        def keep(self, context, value):
            calls["entry"] += 1
            value.set_value(context.get_abstract_state(0).get_value())

    builder = m.DiagramBuilder()
    source = builder.AddSystem(m.DiscreteTimeIntegrator(1, 0.25))
    one = builder.AddSystem(m.ConstantVectorSource([1.0]))
    eyes = builder.AddSystem(Eyes())
    hands = [builder.AddSystem(m.DiscreteTimeIntegrator(1, 0.001)) for _ in range(4)]
    builder.Connect(one.get_output_port(), source.get_input_port())
    builder.Connect(source.get_output_port(), eyes.u)
    for i, hand in enumerate(hands):
        builder.Connect(eyes.get_output_port(i), hand.get_input_port())
    simulator = m.Simulator(builder.Build())
    simulator.AdvanceTo(0.9995)
    context = simulator.get_context()
    found = [hand.get_output_port().Eval(hand.GetMyContextFromRoot(context))[0] for hand in hands]
    return np.array([*found, *calls.values()])


def pendulum_of_expressions(m, damping=0.1):
    """A pendulum written as expressions: swung up, held by a regulator, and linearized where it drives others."""
    x, u = m.MakeVectorVariable(2, "x"), m.MakeVectorVariable(1, "u")
    motion = [x[1], u[0] - damping * x[1] - m.sin(x[0])]

    def pendulum():
        return m.SymbolicVectorSystem(state=x, input=u, dynamics=motion, output=[m.cos(x[0]), m.sin(x[0])])

    system = pendulum()
    context = system.CreateDefaultContext()
    collocation = m.DirectCollocation(system, context, 11, 0.2, 0.4)
    collocation.AddEqualTimeIntervalsConstraints()
    collocation.AddRunningCost(collocation.input()[0] ** 2)
    program = collocation.prog()
    program.AddBoundingBoxConstraint([0.0, 0.0], [0.0, 0.0], collocation.initial_state())
    program.AddBoundingBoxConstraint([2.0, 0.0], [2.0, 0.0], collocation.final_state())
    swing = m.Solve(program)
    options = m.FiniteHorizonLinearQuadraticRegulatorOptions()
    options.x0 = m.PiecewisePolynomial.FirstOrderHold([0.0, 2.0], np.array([[0.0, 1.0], [0.5, 0.5]]))
    options.u0 = m.PiecewisePolynomial(np.array([0.3]))
    options.simulator_config.accuracy = 1e-9
    regulator = m.FiniteHorizonLinearQuadraticRegulator(system, context, 0.0, 2.0, np.eye(2), np.eye(1), options)
    builder = m.DiagramBuilder()
    first, second = builder.AddSystem(pendulum()), builder.AddSystem(pendulum())
    gain = builder.AddSystem(m.MatrixGain(np.array([[0.5, -2.0]])))
    builder.Connect(first.get_output_port(), gain.get_input_port())
    builder.Connect(gain.get_output_port(), second.get_input_port())
    builder.ExportInput(first.get_input_port())
    builder.ExportOutput(second.get_output_port())
    chain = builder.Build()
    context = chain.CreateDefaultContext()
    context.SetContinuousState([0.3, 0.1, -0.4, 0.2])
    chain.get_input_port().FixValue(context, [0.2])
    model = m.FirstOrderTaylorApproximation(chain, context)
    numbers = [swing.is_success(), swing.get_optimal_cost(), *regulator.K.value(0.0).ravel()]
    return np.array([*numbers, *(x for part in (model.A(), model.B(), model.C(), model.f0()) for x in part.ravel())])


def runs_of_one_simulator(m):
    """A pendulum simulated again and again, from one context, others and another accuracy: when it takes its steps."""
    found = []
    for scheme in ("runge_kutta3", "runge_kutta5", "bogacki_shampine3", "implicit_euler"):
        builder = m.DiagramBuilder()
        pendulum = builder.AddSystem(importlib.import_module(f"{m.__name__[:-4]}.examples").PendulumPlant())
        push = builder.AddSystem(m.Sine(1.5, 2.0, 0.1, 1))
        builder.Connect(push.get_output_port(0), pendulum.get_input_port())
        log = m.LogVectorOutput(pendulum.get_state_output_port(), builder)
        diagram = builder.Build()
        simulator = m.Simulator(diagram)
        m.ResetIntegratorFromFlags(simulator, scheme, 0.1)
        for k in range(4):
            if k == 2:
                simulator.reset_context(diagram.CreateDefaultContext())
            if k == 3:
                simulator.get_mutable_integrator().set_target_accuracy(1e-5)
            context = simulator.get_mutable_context()
            context.SetTime(0.0)
            context.SetContinuousState([0.5 + k, 0.0])
            simulator.Initialize()
            log.FindMutableLog(context).Clear()
            simulator.AdvanceTo(0.7)
            found += [log.FindLog(context).num_samples(), *log.FindLog(context).sample_times()]
            found += log.FindLog(context).data()[:, -1].tolist()
    return np.array(found)


PROGRAMS = {
    pendulum_of_expressions: 1e-5,
    random_tree: 1e-9,
    runs_of_one_simulator: 1e-7,
    slow_eyes_and_quick_hands: 1e-9,
    two_arms_and_a_linkage: 1e-6,
}  # and how far numbers may be apart


@pytest.mark.parametrize("program", PROGRAMS, ids=lambda p: p.__name__)
def test_both_libraries_say_the_same(program):
    ours, theirs = map(program, LIBRARIES)
    np.testing.assert_allclose(ours, theirs, rtol=PROGRAMS[program], atol=PROGRAMS[program])


def test_a_planted_fault_is_seen():
    ours = LIBRARIES[0]
    weaker = {"PdControllerGains": lambda p, d: ours.PdControllerGains(p=0.999 * p, d=d)}
    other = two_arms_and_a_linkage(types.SimpleNamespace(**{**vars(ours), **weaker}))
    assert np.abs(two_arms_and_a_linkage(ours) - other).max() > 1e-5


def test_another_damping_is_seen():
    ours = LIBRARIES[0]
    assert np.abs(pendulum_of_expressions(ours) - pendulum_of_expressions(ours, 0.101)).max() > 1e-4
