"""sheldrake.systems.controllers"""
