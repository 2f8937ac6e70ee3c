"""sheldrake.systems.framework._kernels"""
