"""sheldrake.multibody"""
