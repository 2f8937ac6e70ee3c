"""A mesh file as a model: one body of the density of water, with the mesh as its look and its contact shape."""

import os

import numpy as np

from ._files.diagnostics import Location
from ._model.description import BodyDescription, GeometryDescription, ModelDescription
from ._reading.inertia import FALLBACK_DENSITY, solid_properties
from ._reading.reading import Reading, make_pose


def read_mesh_model(reading: Reading, model_name: str = "") -> ModelDescription:
    """The model made of the mesh file that is being read; model and body have the same name.

    Args:
        reading: Its surroundings.
        model_name: Used instead of the file's name without its suffix when not empty.

    Raises:
        ParseError: When the file is not a usable mesh.
    """
    from sheldrake.geometry import IllustrationProperties, Mesh, PerceptionProperties, ProximityProperties
    from sheldrake.multibody.tree import RotationalInertia, SpatialInertia

    where = Location(reading.source)
    stem = os.path.splitext(os.path.basename(reading.source))[0]
    shape = Mesh(reading.source)
    volume, centroid, inertia = solid_properties(shape, where, f"'{stem}'", reading)
    moments, products = np.diag(inertia), (inertia[0, 1], inertia[0, 2], inertia[1, 2])
    I_BBcm_B = RotationalInertia(*(FALLBACK_DENSITY * value for value in (*moments, *products)))
    name = model_name or stem
    body = BodyDescription(where, name)
    body.M_BBo_B = SpatialInertia.MakeFromCentralInertia(FALLBACK_DENSITY * volume, centroid, I_BBcm_B)
    if reading.wants_geometry:
        X_BG = make_pose(np.zeros(3), np.zeros(3))
        visual = GeometryDescription(where, "visual", X_BG, shape)
        visual.illustration, visual.perception = IllustrationProperties(), PerceptionProperties()
        body.visuals.append(visual)
        body.collisions.append(GeometryDescription(where, "collision", X_BG, shape, proximity=ProximityProperties()))
    return ModelDescription(where, name, [body])
