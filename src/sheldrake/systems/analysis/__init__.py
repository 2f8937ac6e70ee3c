"""sheldrake.systems.analysis"""
