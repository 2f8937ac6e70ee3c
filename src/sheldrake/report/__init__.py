"""Reports of runs: one HTML file with replay, plots, contacts, block diagram, model and versions; files for viewers."""

from ._save_report import SaveLogReport, SaveReport
from ._save_run import SaveRun

__all__ = ["SaveLogReport", "SaveReport", "SaveRun"]
