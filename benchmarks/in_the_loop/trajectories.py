"""Trajectories built and evaluated, poses interpolated, paths followed."""

import numpy as np
from pydrake.all import (
    BsplineBasis,
    BsplineTrajectory,
    PiecewisePolynomial,
    PiecewisePose,
    PiecewiseQuaternionSlerp,
    RigidTransform,
    RotationMatrix,
    TrajectorySource,
)


def program():
    t = np.linspace(0, 5, 20)
    pts = np.array([np.sin(t), np.cos(t), 0.1 * t])
    s = 0
    for _ in range(10):
        cubic = PiecewisePolynomial.CubicShapePreserving(t, pts, True)
        PiecewisePolynomial.CubicWithContinuousSecondDerivatives(t, pts, np.zeros(3), np.zeros(3))
        foh = PiecewisePolynomial.FirstOrderHold(t, pts)
        zoh = PiecewisePolynomial.ZeroOrderHold(t, pts)
        d = cubic.derivative()
        dd = d.derivative()
        poses = [RigidTransform(RotationMatrix.MakeZRotation(a), [np.sin(a), 0, 0.1 * a]) for a in t]
        pp = PiecewisePose.MakeLinear(t, poses)
        quat = PiecewiseQuaternionSlerp(t, [X.rotation() for X in poses])
        b = BsplineTrajectory(BsplineBasis(4, 12), [np.array([i, np.sin(i), 0.0])[:, None] for i in range(12)])
        for a in np.linspace(0, 5, 100):
            s += cubic.value(a).sum() + d.value(a).sum() + dd.value(a).sum() + foh.value(a).sum() + zoh.value(a).sum()
            X = pp.GetPose(a)
            V = pp.GetVelocity(a)
            quat.orientation(a)
            s += X.translation().sum() + V.sum()
            s += b.value(a / 5).sum()
        src = TrajectorySource(cubic, 1)
        c = src.CreateDefaultContext()
        for a in np.linspace(0, 5, 100):
            c.SetTime(a)
            s += src.get_output_port().Eval(c).sum()
    return s


for _ in range(3):
    program()
