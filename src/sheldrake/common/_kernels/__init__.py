"""sheldrake.common._kernels"""
