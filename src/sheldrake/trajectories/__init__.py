"""sheldrake.trajectories"""
