"""Reports of runs: one HTML file with replay, plots, contacts, block diagram, model and versions."""

from ._save_report import SaveLogReport, SaveReport

__all__ = ["SaveLogReport", "SaveReport"]
