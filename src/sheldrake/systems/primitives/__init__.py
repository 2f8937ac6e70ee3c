"""sheldrake.systems.primitives"""
