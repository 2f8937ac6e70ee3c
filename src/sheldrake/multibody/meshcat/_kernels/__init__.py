"""Kernels of the viewer: the force of a spring from a body to the mouse."""
