"""sheldrake.geometry._kernels"""
