"""Kernels of kinematic constraints."""
