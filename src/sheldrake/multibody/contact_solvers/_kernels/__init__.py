"""sheldrake.multibody.contact_solvers._kernels"""
