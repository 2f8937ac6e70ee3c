"""sheldrake.visualization"""
