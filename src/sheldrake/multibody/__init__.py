"""Mechanics of rigid bodies: trees of bodies, the plant that simulates them, model files, inverse kinematics.

Nothing lives here itself; import from the modules below, or everything from `sheldrake.multibody.all`.
"""
