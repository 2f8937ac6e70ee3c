"""Compiled numerics of solvers."""
