"""One HTML file about a run: replay, plots in step with it, contacts, block diagram, model, versions."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from sheldrake.common._files import whole_file
from sheldrake.systems.framework._diagram import all_systems

from ._contact_events import find_contact_events
from ._page import Report, make_page
from ._replay import find_meshcat, find_state_logs, replay_of_recording, replay_of_states
from ._summary import facts_of_run, model_tables, run_table, versions_table
from ._timing import timing_of_run

if TYPE_CHECKING:
    from os import PathLike

    from sheldrake.geometry._meshcat.meshcat import Meshcat
    from sheldrake.systems.analysis._simulator import Simulator

_MOST_BODIES = 100  # in a picture of bodies and joints


def SaveReport(
    simulator: Simulator, path: str | PathLike[str], *, title: str = "", meshcat: Meshcat | None = None
) -> None:
    """Writes a report of a run: one HTML file that opens in any browser, without a network.

    It replays the scene with a slider of time, beside plots of everything that was logged: pointing into a plot moves
    the scene, and moving the slider moves the cursors. Contacts are listed with their times and forces, and what each
    stage of a step, log and publish cost; block diagram, model, run and versions follow.

    The replay comes from the logged state of the plants (`LogVectorOutput(plant.get_state_output_port(), builder)` or
    `LogAll(builder)` before Build()), else from what a Meshcat recorded.

    Args:
        simulator: After AdvanceTo().
        path: The file, which is overwritten.
        title: Of the page; by default the name of the diagram.
        meshcat: Where the scene is drawn already; by default the Meshcat of the diagram's MeshcatVisualizer, or a new
            one that lives as long as this call.

    Raises:
        OSError: The file can not be written.
        RuntimeError: The simulator has no context.
    """
    diagram, context = simulator.get_system(), simulator.get_context()
    if context is None:
        raise RuntimeError("SaveReport(): the simulator has no context.")
    from sheldrake.systems.primitives import LogSet, VectorLogSink
    from sheldrake.systems.primitives._log_files import find_sinks
    from sheldrake.visualization import DrawDiagram, DrawTopology

    sinks = find_sinks(diagram, context)
    meshcat = meshcat if meshcat is not None else find_meshcat(diagram)
    logs = find_state_logs(context, sinks)
    systems = all_systems(diagram)
    report = Report(title or diagram.get_name() or "Simulation")
    report.replay = replay_of_states(diagram, context, logs, meshcat)
    if report.replay is None and meshcat is not None:
        report.replay = replay_of_recording(meshcat)
    report.logs = LogSet({name: sink.FindLog(context) for name, sink in sinks.items()})
    if logs:
        report.events, report.look = find_contact_events(context, logs)
    report.timing = timing_of_run(simulator, logs, sinks)
    report.facts = facts_of_run(simulator, report.timing)
    # Logs would be half of the picture.
    report.diagram = DrawDiagram(diagram, leave_out=lambda system: isinstance(system, VectorLogSink))
    plants = [s for s in systems if hasattr(s, "GetJointActuatorIndices") and hasattr(s, "is_finalized")]
    report.topologies = {
        plant.get_name(): DrawTopology(plant) for plant in plants if plant.num_bodies() <= _MOST_BODIES
    }
    report.tables = [run_table(simulator), *model_tables(plants), versions_table(systems)]
    text = make_page(report)
    with whole_file(path, encoding="utf-8", newline="\n") as file:
        file.write(text)


def SaveLogReport(logs: Any, path: str | PathLike[str], *, title: str = "Logs") -> None:
    """Writes the plots of logs as one HTML file, without a scene.

    Args:
        logs: A LogSet, such as ReadLogs() gives.
        path: The file, which is overwritten.
        title: Of the page.

    Raises:
        OSError: The file can not be written.
    """
    report = Report(title)
    report.logs = logs
    report.tables = [versions_table([])]
    with whole_file(path, encoding="utf-8", newline="\n") as file:
        file.write(make_page(report))
