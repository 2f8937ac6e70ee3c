"""Equations of motion of the examples."""
