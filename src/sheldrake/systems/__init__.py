"""sheldrake.systems"""
