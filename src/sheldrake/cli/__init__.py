"""sheldrake.cli"""
