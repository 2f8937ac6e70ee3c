"""The integration step in kernels."""
