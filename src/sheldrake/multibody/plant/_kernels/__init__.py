"""sheldrake.multibody.plant._kernels"""
