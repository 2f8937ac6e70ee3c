"""Controllers in Python that the programs beside this module share."""

import numpy as np
from pydrake.all import JacobianWrtVariable, LeafSystem


class HoverController(LeafSystem):
    """Commands of four propellers that keep a quadrotor upright at the origin."""

    def __init__(self, weight):
        super().__init__()
        self._weight = weight
        self.DeclareVectorInputPort("x", 13)
        self.DeclareVectorOutputPort("u", 4, self._calc)

    def _calc(self, context, output):
        x = self.get_input_port().Eval(context)
        roll, pitch, yaw = 2.0 * x[1], 2.0 * x[2], 2.0 * x[3]
        position, w, v = x[4:7], x[7:10], x[10:13]
        lift = 0.25 * (self._weight - 4.0 * position[2] - 3.0 * v[2])
        tilt_x = 0.6 * (roll + 0.15 * position[1] + 0.2 * v[1]) + 0.12 * w[0]
        tilt_y = 0.6 * (pitch - 0.15 * position[0] - 0.2 * v[0]) + 0.12 * w[1]
        turn = 0.3 * yaw + 0.3 * w[2]
        output.SetFromVector([lift + tilt_y - turn, lift - tilt_x + turn, lift - tilt_y - turn, lift + tilt_x + turn])


class InverseDynamicsInPython(LeafSystem):
    """Joint torques by the plant's own mass matrix and bias, on a copy of its context."""

    def __init__(self, plant, kp, kd):
        super().__init__()
        self._plant, self._context = plant, plant.CreateDefaultContext()
        n = self._n = plant.num_positions()
        self._kp, self._kd = kp, kd
        self.DeclareVectorInputPort("x", 2 * n)
        self.DeclareVectorInputPort("desired", 2 * n)
        self.DeclareVectorOutputPort("u", n, self._calc)

    def _calc(self, context, output):
        n, x = self._n, self.get_input_port(0).Eval(context)
        desired = self.get_input_port(1).Eval(context)
        self._plant.SetPositionsAndVelocities(self._context, x)
        M = self._plant.CalcMassMatrix(self._context)
        bias = self._plant.CalcBiasTerm(self._context)
        gravity = self._plant.CalcGravityGeneralizedForces(self._context)
        error = desired - x
        output.SetFromVector(M @ (self._kp * error[:n] + self._kd * error[n:]) + bias - gravity)


class HybridForcePosition(LeafSystem):
    """Torques that press the tip with a force along z and hold its place along x and y."""

    def __init__(self, plant, tip, force, place):
        super().__init__()
        self._plant, self._context, self._tip = plant, plant.CreateDefaultContext(), tip
        self._force, self._place = force, place
        n = self._n = plant.num_positions()
        self.DeclareVectorInputPort("x", 2 * n)
        self.DeclareVectorOutputPort("u", n, self._calc)

    def _calc(self, context, output):
        plant, own = self._plant, self._context
        plant.SetPositionsAndVelocities(own, self.get_input_port().Eval(context))
        W = plant.world_frame()
        X_WT = plant.EvalBodyPoseInWorld(own, self._tip)
        V_WT = plant.EvalBodySpatialVelocityInWorld(own, self._tip)
        J = plant.CalcJacobianTranslationalVelocity(
            own, JacobianWrtVariable.kV, self._tip.body_frame(), [0, 0, 0], W, W
        )
        p, v = X_WT.translation(), V_WT.translational()
        F = np.array([400.0, 400.0, 0.0]) * (self._place - p) - np.array([40.0, 40.0, 15.0]) * v
        F[2] += self._force
        tau = J.T @ F - plant.CalcGravityGeneralizedForces(own) - 2.0 * plant.GetVelocities(own)
        output.SetFromVector(tau)


class Waypoints(LeafSystem):
    """Desired positions and velocities on a smooth curve."""

    def __init__(self, n):
        super().__init__()
        self._n = n
        self.DeclareVectorOutputPort("desired", 2 * n, self._calc)

    def _calc(self, context, output):
        t, n = context.get_time(), self._n
        phase = np.arange(n)
        output.SetFromVector(np.concatenate([0.4 * np.sin(t + phase), 0.4 * np.cos(t + phase)]))


class StateMachine(LeafSystem):
    """A mode that changes with time, as abstract state, and a gripper command that follows from it."""

    def __init__(self):
        super().__init__()
        from pydrake.all import AbstractValue

        self._mode = self.DeclareAbstractState(AbstractValue.Make("open"))
        self.DeclarePeriodicUnrestrictedUpdateEvent(0.02, 0.0, self._update)
        self.DeclareVectorOutputPort("command", 2, self._calc)

    def _update(self, context, state):
        mode = "open" if context.get_time() % 0.4 < 0.2 else "closed"
        state.get_mutable_abstract_state(int(self._mode)).set_value(mode)

    def _calc(self, context, output):
        mode = context.get_abstract_state(int(self._mode)).get_value()
        output.SetFromVector([5.0, 5.0] if mode == "open" else [-5.0, -5.0])
