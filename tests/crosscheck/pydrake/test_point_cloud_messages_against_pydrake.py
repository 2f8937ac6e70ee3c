"""Messages of point clouds: Drake's, byte by byte."""

import importlib

import numpy as np
import pytest

pydrake = pytest.importorskip("pydrake")
drake = pytest.importorskip("drake")
pytestmark = pytest.mark.peer

from sheldrake.lcm._messages import lcmt_point_cloud  # noqa: E402


def publish(library, fields, frame, fault=0.0):
    """The bytes that PointCloudToLcm's message has on the wire."""
    lib = importlib.import_module(f"{library}.all")
    field = lib.BaseField
    cloud = lib.PointCloud(4, lib.Fields(int(sum(int(getattr(field, name)) for name in fields))))
    random = np.random.default_rng(1)
    cloud.mutable_xyzs()[:] = random.normal(size=(3, 4))
    cloud.mutable_xyzs()[1, 2] = np.inf
    cloud.mutable_xyzs()[0, 0] += fault
    if "kRGBs" in fields:
        cloud.mutable_rgbs()[:] = random.integers(0, 256, (3, 4))
    if "kNormals" in fields:
        cloud.mutable_normals()[:] = random.normal(size=(3, 4))
    builder, lcm, messages = lib.DiagramBuilder(), lib.DrakeLcm("memq://"), []
    source = builder.AddSystem(lib.ConstantValueSource(lib.Value(cloud)))
    system = builder.AddSystem(lib.PointCloudToLcm(frame) if frame else lib.PointCloudToLcm())
    kind, more = (
        (drake.lcmt_point_cloud, {"use_cpp_serializer": True}) if library == "pydrake" else (lcmt_point_cloud, {})
    )
    publisher = builder.AddSystem(lib.LcmPublisherSystem.Make("C", kind, lcm, publish_period=0.5, **more))
    builder.Connect(source.get_output_port(), system.get_input_port())
    builder.Connect(system.get_output_port(), publisher.get_input_port())
    lcm.Subscribe("C", messages.append)
    simulator = lib.Simulator(builder.Build())
    simulator.AdvanceTo(1.2)
    lcm.HandleSubscriptions(0)
    return bytes(messages[-1])


@pytest.mark.parametrize("frame", ["", "a", "world", "camera/optical"])
@pytest.mark.parametrize(
    "fields", [["kXYZs"], ["kXYZs", "kRGBs"], ["kXYZs", "kNormals"], ["kXYZs", "kRGBs", "kNormals"]]
)
def test_messages_equal_drakes(fields, frame):
    assert publish("sheldrake", fields, frame) == publish("pydrake", fields, frame)


def test_another_number_is_another_message():
    assert publish("sheldrake", ["kXYZs"], "a", fault=1e-6) != publish("pydrake", ["kXYZs"], "a")
