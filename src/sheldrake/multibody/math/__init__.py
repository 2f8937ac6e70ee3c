"""sheldrake.multibody.math"""
