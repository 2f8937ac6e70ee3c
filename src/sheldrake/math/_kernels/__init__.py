"""Kernels of matrix equations."""
