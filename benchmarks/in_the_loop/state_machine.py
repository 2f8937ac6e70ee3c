"""A state machine in Python with abstract state, unrestricted updates and several ports; a gripper picks."""

from enum import Enum

import _robots as robots
import numpy as np
from pydrake.all import (
    AbstractValue,
    AddMultibodyPlantSceneGraph,
    DiagramBuilder,
    InverseDynamicsController,
    LeafSystem,
    MultibodyPlant,
    Parser,
    PiecewisePolynomial,
    RigidTransform,
    RollPitchYaw,
    Simulator,
)


class Mode(Enum):
    A = 0
    B = 1
    C = 2


class Planner(LeafSystem):
    def __init__(self, plant):
        super().__init__()
        self._tip = plant.GetBodyByName("link7").index()
        self.DeclareAbstractInputPort("body_poses", AbstractValue.Make([RigidTransform()]))
        self.DeclareVectorInputPort("state", 14)
        self._mode = self.DeclareAbstractState(AbstractValue.Make(Mode.A))
        self._traj = self.DeclareAbstractState(AbstractValue.Make(PiecewisePolynomial()))
        self._times = self.DeclareAbstractState(AbstractValue.Make({"start": 0.0}))
        self._n = int(self.DeclareDiscreteState(1))
        self.DeclareAbstractOutputPort("X_goal", lambda: AbstractValue.Make(RigidTransform()), self.CalcPose)
        self.DeclareVectorOutputPort("q_cmd", 14, self.CalcCmd)
        self.DeclarePeriodicUnrestrictedUpdateEvent(0.01, 0.0, self.Update)
        self.DeclareInitializationUnrestrictedUpdateEvent(self.Init)

    def Init(self, context, state):
        self.plan(context, state)

    def plan(self, context, state):
        self.get_input_port(0).Eval(context)[int(self._tip)]
        x = self.get_input_port(1).Eval(context)
        t = context.get_time()
        goal = x[:7] + 0.1 * np.sin(t + np.arange(7))
        state.get_mutable_abstract_state(int(self._traj)).set_value(
            PiecewisePolynomial.CubicShapePreserving(
                [t, t + 0.1, t + 0.2], np.column_stack([x[:7], (goal + x[:7]) / 2, goal]), True
            )
        )
        state.get_mutable_abstract_state(int(self._times)).set_value({"start": t})

    def Update(self, context, state):
        mode = context.get_abstract_state(int(self._mode)).get_value()
        times = context.get_abstract_state(int(self._times)).get_value()
        t = context.get_time()
        if t > times["start"] + 0.1:
            nxt = {Mode.A: Mode.B, Mode.B: Mode.C, Mode.C: Mode.A}[mode]
            state.get_mutable_abstract_state(int(self._mode)).set_value(nxt)
            self.plan(context, state)
            state.get_mutable_discrete_state().set_value([t])

    def CalcPose(self, context, output):
        output.set_value(RigidTransform(RollPitchYaw(0, 0, context.get_time()), [0, 0, 1]))

    def CalcCmd(self, context, output):
        traj = context.get_mutable_abstract_state(int(self._traj)).get_value()
        t = context.get_time()
        output.SetFromVector(np.concatenate([traj.value(t).ravel(), traj.EvalDerivative(t, 1).ravel()]))


class Watch(LeafSystem):
    def __init__(self):
        super().__init__()
        self.DeclareAbstractInputPort("X", AbstractValue.Make(RigidTransform()))
        self.DeclarePerStepPublishEvent(self.pub)
        self.n = 0

    def pub(self, context):
        X = self.get_input_port(0).Eval(context)
        self.n += X.translation()[2]


def program():
    builder = DiagramBuilder()
    plant, _sg = AddMultibodyPlantSceneGraph(builder, 0.001)
    Parser(plant).AddModelsFromString(robots.arm(), "urdf")
    plant.Finalize()
    ctrl = MultibodyPlant(0.001)
    Parser(ctrl).AddModelsFromString(robots.arm(), "urdf")
    ctrl.Finalize()
    idc = builder.AddSystem(InverseDynamicsController(ctrl, [100] * 7, [1] * 7, [20] * 7, False))
    p = builder.AddSystem(Planner(plant))
    w = builder.AddSystem(Watch())
    builder.Connect(plant.get_body_poses_output_port(), p.GetInputPort("body_poses"))
    builder.Connect(plant.get_state_output_port(), p.GetInputPort("state"))
    builder.Connect(p.GetOutputPort("q_cmd"), idc.get_input_port_desired_state())
    builder.Connect(plant.get_state_output_port(), idc.get_input_port_estimated_state())
    builder.Connect(idc.get_output_port_control(), plant.get_actuation_input_port())
    builder.Connect(p.GetOutputPort("X_goal"), w.get_input_port(0))
    diagram = builder.Build()
    simulator = Simulator(diagram)
    simulator.AdvanceTo(0.5)
    return w.n


for _ in range(3):
    program()
