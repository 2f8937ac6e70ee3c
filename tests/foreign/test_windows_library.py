"""The library in the Windows wheel, loaded and run by wine: the same span as here, the same numbers."""

from __future__ import annotations

import os
import pathlib
import shutil
import subprocess

import numpy as np
import pytest
from spans import Case

from sheldrake import model_path
from sheldrake.geometry import HalfSpace
from sheldrake.math import RigidTransform, RollPitchYaw
from sheldrake.multibody.parsing import Parser
from sheldrake.multibody.plant import AddMultibodyPlantSceneGraph, CoulombFriction
from sheldrake.systems.analysis import Simulator
from sheldrake.systems.framework import DiagramBuilder
from sheldrake.systems.primitives import LogVectorOutput

WINE = next(filter(None, map(shutil.which, ("wine64", "wine", "/usr/lib/wine/wine64"))), None)
pytestmark = pytest.mark.skipif(WINE is None, reason="needs wine (Debian: apt install wine64)")


def falling_block() -> Simulator:
    """A block above the ground, and a log of its state."""
    builder = DiagramBuilder()
    plant, _ = AddMultibodyPlantSceneGraph(builder, time_step=1e-3)
    Parser(plant).AddModels(model_path("two_hole_block/two_hole_block.urdf"))
    ground = HalfSpace(), "ground", CoulombFriction(0.7, 0.5)
    plant.RegisterCollisionGeometry(plant.world_body(), RigidTransform(), *ground)
    plant.Finalize()
    LogVectorOutput(plant.get_state_output_port(), builder)
    simulator = Simulator(builder.Build())
    (body,) = (plant.get_body(i) for i in plant.GetFloatingBaseBodies())
    X_WB = RigidTransform(RollPitchYaw(0.3, 0.2, 0.1), [0.0, 0.0, 0.1])
    plant.SetFreeBodyPose(plant.GetMyMutableContextFromRoot(simulator.get_mutable_context()), body, X_WB)
    simulator.Initialize()
    return simulator


def run(program: pathlib.Path, *arguments: pathlib.Path, home: pathlib.Path) -> None:
    environment = {**os.environ, "WINEPREFIX": str(home), "WINEDEBUG": "-all", "HOME": str(home)}
    subprocess.run([WINE, program, *arguments], check=True, env=environment, timeout=600)


@pytest.fixture(scope="module")
def home(tmp_path_factory):
    """Wine's own folder."""
    return tmp_path_factory.mktemp("wine")


@pytest.fixture(scope="module", params=[1, 3])
def result(request, wheels, driver, home, tmp_path_factory):
    """What a span of the falling block gives here and there: half a second, through its first contacts."""
    folder = tmp_path_factory.mktemp("span")
    simulator = falling_block()
    simulator.AdvanceTo(0.1)
    case = Case(simulator._span, 0.6, level=request.param)
    case.write(folder / "case")
    dll = wheels / "prebuilt" / "windows-x86_64" / "kernels.dll"
    run(driver("x86_64-windows-gnu", ".exe"), dll, folder / "case", folder / "result", home=home)
    status, there = case.read(folder / "result")
    here = simulator._span
    assert here.advance(0.6) == status
    return here.store, there


def test_windows_gives_the_numbers_of_this_machine(result):
    store, there = result
    assert there["S"][0] == store.S[0] > 0.1
    state = slice(*store.layout.xd)
    np.testing.assert_allclose(there["S"][state], store.S[state], rtol=1e-7, atol=1e-9)
    np.testing.assert_allclose(there["L"], store.L, rtol=1e-7, atol=1e-9)


def test_the_span_did_something(result):
    logged = result[1]["L"]
    assert len(np.unique(logged)) > 500
