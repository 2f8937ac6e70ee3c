"""Expressions in machine code."""
