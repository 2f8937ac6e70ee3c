"""sheldrake.geometry"""
