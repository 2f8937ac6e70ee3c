"""Damaged files: an error that is a ValueError or a finding, in bounded time, and never nonsense."""

import random
import re
import time

import numpy as np
import pytest
from tests.unit.cad import solids
from tests.unit.cad.test_doctor import box_link, joint, robot

from sheldrake.cad import DiagnoseModel, MakeUrdfFromMesh

BOX = solids.box(60.0, 40.0, 25.0)
MESHES = {
    "a.stl": solids.binary_stl(*BOX),
    "b.stl": solids.ascii_stl(("x", BOX)),
    "c.obj": solids.obj(*BOX),
    "d.ply": solids.ply(*BOX),
    "e.dae": solids.dae(*BOX),
    "f.3mf": solids.threemf(*BOX),
}
WORDS = [b"-1", b"1e999", b"nan", b"99999999999", b'"', b"<", b"/>", b"\x00\xff\xff\xff\x7f", b'name="a"', b""]


def damaged(data, rng):
    """A copy with bytes changed, taken out, put in or repeated, and attributes exchanged."""
    data = bytearray(data)
    for _ in range(rng.choice([1, 1, 2, 5, 20])):
        kind, at = rng.randrange(5), rng.randrange(max(len(data), 1))
        if kind == 0 and data:
            data[at] = rng.randrange(256)
        elif kind == 1:
            del data[at : at + rng.randrange(1, 40)]
        elif kind == 2:
            data[at:at] = rng.choice(WORDS)
        elif kind == 3:
            start = rng.randrange(max(len(data), 1))
            data[at:at] = data[start : start + 100]
        else:
            values = list(re.finditer(rb'"[^"]*"', bytes(data)))
            if values:
                found = rng.choice(values)
                data[found.start() : found.end()] = b'"' + rng.choice(WORDS).replace(b'"', b"") + b'"'
    return bytes(data)


@pytest.mark.parametrize("name", MESHES)
def test_damaged_meshes(tmp_path, name):
    rng = random.Random(name)
    made = 0
    for _ in range(60):
        path = tmp_path / name
        path.write_bytes(damaged(MESHES[name], rng))
        begin = time.process_time()
        try:
            model = MakeUrdfFromMesh(path, units="mm", mass=1.0, collision=rng.choice(["mesh", "hull", "decompose"]))
        except ValueError as error:
            assert name in str(error) or "solid" in str(error)
            continue
        finally:
            assert time.process_time() - begin < 10.0  # [s] of the processor; some milliseconds are usual
        made += 1
        assert model.mass == 1.0 and 0.0 < model.volume < np.inf
        assert np.isfinite(model.I_BBcm_B).all() and np.isfinite(model.p_BoBcm_B).all()
    assert made > 0


def test_damaged_descriptions(tmp_path):
    text = robot(
        box_link("a"), box_link("b"), box_link("c"),
        joint("j1", "a", "b", '<limit lower="1" upper="-1" effort="5" velocity="1"/><mimic joint="j2"/>'),
        joint("j2", "b", "c"),
    ).encode()  # fmt: skip
    rng = random.Random(5)
    unreadable = 0
    for _ in range(250):
        path = tmp_path / "robot.urdf"
        path.write_bytes(damaged(text, rng))
        begin = time.process_time()
        diagnosis = DiagnoseModel(path)
        diagnosis.WriteFixed(tmp_path / "fixed.urdf")
        assert time.process_time() - begin < 10.0
        assert diagnosis.findings  # the reversed limits, if nothing else
        unreadable += any(finding.code == "unreadable" for finding in diagnosis.findings)
    assert 50 < unreadable < 250
