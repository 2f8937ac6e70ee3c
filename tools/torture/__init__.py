"""Campaigns against sheldrake: input of others, calls in any order, files and processes that fail; see `__main__`."""
