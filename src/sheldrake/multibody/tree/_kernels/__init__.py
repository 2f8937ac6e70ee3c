"""sheldrake.multibody.tree._kernels"""
