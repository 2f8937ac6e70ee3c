"""Files for LoadContext that somebody made by hand: refused by name, or harmless."""

import io
import json
import zipfile

import numpy as np
import pytest
from tests.unit.systems.framework.saved_run import build

from sheldrake.common import RandomDistribution, RandomGenerator
from sheldrake.common.value import Value
from sheldrake.systems.analysis import BogackiShampine3Integrator, Simulator
from sheldrake.systems.framework import DiagramBuilder, LeafSystem, LoadContext, SaveContext
from sheldrake.systems.primitives import ConstantVectorSource, Integrator, LogVectorOutput, RandomSource


@pytest.fixture(scope="module")
def scene(tmp_path_factory):
    """A diagram and the arrays of a file with its context."""
    path = tmp_path_factory.mktemp("saved") / "run.npz"
    diagram = build()
    simulator = Simulator(diagram)
    simulator.AdvanceTo(0.3)
    SaveContext(simulator.get_context(), path)
    with np.load(path) as found:
        return diagram, dict(found)


def load(scene, path, **changed):
    """Loads the file with other arrays; `meta` as a dict that replaces entries."""
    diagram, arrays = scene
    arrays = {name: a.copy() for name, a in arrays.items()}
    if "meta" in changed:
        changed["meta"] = np.array(json.dumps({**json.loads(str(arrays["meta"])), **changed["meta"]}))
    np.savez(path, **{**arrays, **changed})
    return LoadContext(diagram, path)


def meta(scene):
    return json.loads(str(scene[1]["meta"]))


def refused(scene, path, **changed):
    with pytest.raises(RuntimeError, match=r"LoadContext\(\): .* (is no file of SaveContext|was saved for)"):
        load(scene, path, **changed)


def test_the_file_itself_is_fine(scene, tmp_path):
    load(scene, tmp_path / "a.npz")


@pytest.mark.parametrize("name", ["S", "I", "L"])
def test_arrays_of_another_size(scene, tmp_path, name):
    array = scene[1][name]
    for other in (array[:1], array[:0], array[:-1], np.r_[array, array[:1]]):
        refused(scene, tmp_path / "a.npz", **{name: other})


def layout_of(scene):
    return scene[0].CreateDefaultContext()._store.layout


@pytest.mark.parametrize("value", [-1, -(2**63), 2**62, 10**9, 2])
def test_counters_clocks_flags_and_tables_of_logs(scene, tmp_path, value):
    layout, side = layout_of(scene), scene[1]["I"]
    wrong = list(range(layout.trig0, len(side)))
    if value != 2:
        wrong += list(range(3)) * (value != 10**9) + list(range(layout.k0, layout.trig0)) * (value != 10**9)
    for at in wrong:
        if side[at] != value:
            other = side.copy()
            other[at] = value
            if layout.log0 <= at < layout.fixed0 and (at - layout.log0) % 3 == 2 and value == 2:
                continue  # fewer samples: as good as any
            refused(scene, tmp_path / "a.npz", I=other)


def test_what_a_failed_run_left_does_not_count(scene, tmp_path):
    side = scene[1]["I"].copy()
    side[3:8] = -7
    context = load(scene, tmp_path / "a.npz", I=side)
    assert np.all(context._store.I[3:8] == 0)


@pytest.mark.parametrize("value", [-1, 10**15, 2**40, -(2**63)])
def test_integers_in_scratch_never_leave_it(scene, tmp_path, value):
    layout, S = layout_of(scene), scene[1]["S"]
    refusals = 0
    for n in layout.leaves:
        begin, end = layout.places[n].work
        for at in np.unique(np.linspace(begin, end - 1, 150).astype(int)) if end > begin else ():
            other = S.copy()
            other.view(np.int64)[at] = value
            try:
                context = load(scene, tmp_path / "a.npz", S=other)
            except RuntimeError:
                refusals += 1
                continue
            for system in scene[0].GetSystems():
                own = system.GetMyContextFromRoot(context)
                for j in range(system.num_output_ports()):
                    try:
                        system.get_output_port(j).Eval(own)
                    except (RuntimeError, IndexError):
                        pass
    every = S.copy()
    for n in layout.leaves:
        every.view(np.int64)[slice(*layout.places[n].work)] = value
    refused(scene, tmp_path / "a.npz", S=every)


@pytest.mark.parametrize("value", [np.nan, np.inf])
def test_time_is_a_number(scene, tmp_path, value):
    S = scene[1]["S"].copy()
    S[0] = value
    refused(scene, tmp_path / "a.npz", S=S)


WRONG = (None, 3, -1, "x", [], [1], [[1]], {}, {"a": 1}, [[0, 10**9]], [[-1, 0]], [[10**9, 0]], 1e400, True)


@pytest.mark.parametrize("key", ["structure", "overrides", "accuracy", "stopped", "abstract", "parameters", "fixed"])
@pytest.mark.parametrize("value", WRONG, ids=map(repr, WRONG))
def test_words_of_another_kind(scene, tmp_path, key, value):
    harmless = {"overrides": ([],), "accuracy": (None, 3, -1), "stopped": (None,), "fixed": ({},)}
    if value == meta(scene)[key] or any(value is x or value == x for x in harmless.get(key, ())):
        pytest.skip("as good as any")
    refused(scene, tmp_path / "a.npz", meta={key: value})


def test_a_description_that_is_none(scene, tmp_path):
    for text in ("3", "[]", "null", "{}", "[" * 100_000, '{"format": 1}', "NaN"):
        arrays = {**scene[1], "meta": np.array(text)}
        np.savez(tmp_path / "a.npz", **arrays)
        with pytest.raises(RuntimeError, match="is no file of SaveContext"):
            LoadContext(scene[0], tmp_path / "a.npz")


def test_a_header_that_python_cannot_read(scene, tmp_path):
    """NumPy has Python's tokenizer look at a header that its parser does not take; that has errors of its own."""
    np.savez(tmp_path / "a.npz", **scene[1])
    text = (tmp_path / "a.npz").read_bytes()
    at = text.index(b"}  ")
    (tmp_path / "a.npz").write_bytes(text[: at + 1] + b"(" + text[at + 2 :])
    with pytest.raises(RuntimeError, match="is no file of SaveContext"):
        LoadContext(scene[0], tmp_path / "a.npz")


def test_an_archive_that_grows_when_it_is_read(scene, tmp_path):
    path = tmp_path / "bomb.npz"
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as file:
        for name, array in scene[1].items():
            stream = io.BytesIO()
            np.save(stream, array)
            file.writestr(f"{name}.npy", stream.getvalue())
    with pytest.raises(RuntimeError, match="compressed"):
        LoadContext(scene[0], path)


def test_a_random_generator_takes_no_state_that_is_none():
    good = RandomGenerator(3).ToPlain()
    RandomGenerator().SetFromPlain(good)
    for position in (-1, 625, 10**9, 2**62, 1.5, None):
        with pytest.raises(ValueError, match="no state"):
            RandomGenerator().SetFromPlain({**good, "position": position})
    for key in (good["key"][:-1], good["key"].astype(float), np.zeros(0, np.uint64)):
        with pytest.raises(ValueError, match="no state"):
            RandomGenerator().SetFromPlain({**good, "key": key})


@pytest.mark.parametrize("spare", ["x", [1.0], float("nan"), 3, True, {"a": 1}])
def test_a_random_source_goes_on_from_numbers_alone(tmp_path, spare):
    builder = DiagramBuilder()
    builder.AddSystem(RandomSource(RandomDistribution.kGaussian, 1, 0.1))
    diagram = builder.Build()
    SaveContext(diagram.CreateDefaultContext(), tmp_path / "a.npz")
    with np.load(tmp_path / "a.npz") as found:
        mine = diagram, dict(found)
    entries = meta(mine)["abstract"]
    assert entries[0]["plain_of"]["dict"]["spare"]["plain"] is not None
    load(mine, tmp_path / "b.npz")
    entries[0]["plain_of"]["dict"]["spare"] = {"plain": spare}
    refused(mine, tmp_path / "b.npz", meta={"abstract": entries})
    refused(mine, tmp_path / "b.npz", meta={"abstract": [{"plain": 3}]})


class Blackboard(LeafSystem):
    """Takes a text."""

    def __init__(self):
        super().__init__()
        self.DeclareAbstractInputPort("text", Value[str](""))


def test_fixed_values_have_the_type_of_their_port(tmp_path):
    system = Blackboard()
    context = system.CreateDefaultContext()
    system.get_input_port().FixValue(context, "hello")
    path = tmp_path / "fixed.npz"
    SaveContext(context, path)
    with np.load(path) as found:
        mine = system, dict(found)
    assert system.get_input_port().Eval(load(mine, tmp_path / "a.npz")) == "hello"
    for fixed in ({}, {"0": {"plain": 3}}, {"1": {"plain": "a"}}, {"0": {"plain": "a"}, "5": {"plain": "a"}}, {"0": 1}):
        refused(mine, tmp_path / "a.npz", meta={"fixed": fixed})


@pytest.mark.parametrize("memory", [[], ["x"], [None], [-1.0], [float("nan")], [[1.0]], {}])
def test_what_an_integrator_remembers(tmp_path, memory):
    def simulator_of(context=None):
        simulator = Simulator(diagram, context)
        simulator.reset_integrator(BogackiShampine3Integrator(diagram, simulator.get_mutable_context()))
        simulator.get_mutable_integrator().set_maximum_step_size(0.1)
        return simulator

    builder = DiagramBuilder()
    source, integrator = builder.AddSystem(ConstantVectorSource([1.0])), builder.AddSystem(Integrator(1))
    builder.Connect(source.get_output_port(), integrator.get_input_port())
    diagram = builder.Build()
    simulator = simulator_of()
    simulator.AdvanceTo(0.25)
    SaveContext(simulator.get_context(), tmp_path / "a.npz")
    with np.load(tmp_path / "a.npz") as found:
        mine = diagram, dict(found)
    t, name, _ = meta(mine)["stopped"]
    with pytest.raises(RuntimeError, match=r"no such thing|no file of"):
        simulator_of(load(mine, tmp_path / "b.npz", meta={"stopped": [t, name, memory]})).AdvanceTo(0.5)


def test_a_diagram_built_again_in_the_same_process_takes_the_file(tmp_path):
    def diagram():
        inner, builder = DiagramBuilder(), DiagramBuilder()
        source, integrator = inner.AddSystem(ConstantVectorSource([1.0])), inner.AddSystem(Integrator(1))
        inner.Connect(source.get_output_port(), integrator.get_input_port())
        LogVectorOutput(integrator.get_output_port(), inner)
        builder.AddSystem(inner.Build())
        builder.AddSystem(Integrator(2)).set_name("named")
        return builder.Build()

    first, second = diagram(), diagram()
    context = first.CreateDefaultContext()
    context.SetContinuousState([5.0, 6.0, 7.0])
    SaveContext(context, tmp_path / "a.npz")
    found = LoadContext(second, tmp_path / "a.npz")
    assert found.get_continuous_state_vector().CopyToVector().tolist() == [5.0, 6.0, 7.0]
    next(s for s in second.GetSystems() if s.get_name() == "named").set_name("renamed")
    with pytest.raises(RuntimeError, match="renamed"):
        LoadContext(second, tmp_path / "a.npz")
