"""Kernels of the drivers."""
