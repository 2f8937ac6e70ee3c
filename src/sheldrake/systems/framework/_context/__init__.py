"""Contexts: one system's view of what changes, its defaults, and contexts in words and files."""
