"""The process in which trials run: `python -m tools.torture.child NAME TRIAL LIMIT SEED FIRST END SECONDS PROGRESS`."""

from __future__ import annotations

import importlib
import logging
import sys
import warnings

from tools.torture.campaign import Campaign, work

logging.getLogger("drake").setLevel(logging.CRITICAL + 1)
warnings.simplefilter("ignore")
name, trial, limit, seed, first, end, seconds, path = sys.argv[1:]
module, function = trial.split(":")
campaign = Campaign(name, getattr(importlib.import_module(module), function), 0, float(limit), "")
work(campaign, int(seed), int(first), int(end), float(seconds), path)
