"""sheldrake.systems.primitives._kernels"""
