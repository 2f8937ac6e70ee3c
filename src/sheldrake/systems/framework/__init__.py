"""sheldrake.systems.framework"""
