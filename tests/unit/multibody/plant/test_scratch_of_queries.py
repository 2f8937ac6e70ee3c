"""What accelerations of the present state are computed in is not cleaned where a run writes before it reads."""

import numpy as np
import pytest

from sheldrake import geometry as g
from sheldrake.math import RigidTransform
from sheldrake.multibody.math import SpatialInertia
from sheldrake.multibody.plant import AddMultibodyPlantSceneGraph, CoulombFriction
from sheldrake.multibody.plant._step.advance import _rows_of_a_run
from sheldrake.systems.framework import DiagramBuilder


def pile(time_step, compliant):
    """Boxes and a cylinder that overlap, some of them compliant: points found by search, and contact surfaces."""
    builder = DiagramBuilder()
    plant, _ = AddMultibodyPlantSceneGraph(builder, time_step)
    if time_step > 0.0:
        plant.SetUseSampledOutputPorts(False)
    shapes = [g.Box(0.2, 0.2, 0.2), g.Cylinder(0.1, 0.2), g.Box(0.1, 0.3, 0.2), g.Sphere(0.1)]
    for k, shape in enumerate(shapes):
        body = plant.AddRigidBody(f"body{k}", SpatialInertia.SolidSphereWithMass(1.0, 0.1))
        properties = g.ProximityProperties()
        g.AddContactMaterial(properties=properties, friction=CoulombFriction(0.5, 0.5), point_stiffness=1e4)
        if k in compliant:
            g.AddCompliantHydroelasticProperties(0.05, 1e6, properties)
        plant.RegisterCollisionGeometry(body, RigidTransform(), shape, f"shape{k}", properties)
    plant.Finalize()
    context = builder.Build().CreateDefaultContext()
    for k in range(len(shapes)):
        X_WB = RigidTransform([0.02 * k, 0.01 * k, 0.15 * k])
        plant.SetFreeBodyPose(plant.GetMyMutableContextFromRoot(context), plant.GetBodyByName(f"body{k}"), X_WB)
    return plant, plant.GetMyMutableContextFromRoot(context)


@pytest.mark.parametrize("time_step", [0.0, 0.001])
@pytest.mark.parametrize("compliant", [(), (0, 2, 3)])
def test_what_is_left_there_is_not_read(time_step, compliant):
    plant, context = pile(time_step, compliant)

    def found():
        plant.SetPositions(context, plant.GetPositions(context))  # which makes what was found old
        return plant.get_generalized_acceleration_output_port().Eval(context)

    first = found()
    for array in _rows_of_a_run(plant._parts.contexts.view(context).rehearsal.work):
        array[...] = np.nan if array.dtype == float else -7
    assert found().tobytes() == first.tobytes()
    assert np.abs(first).max() > 1.0
