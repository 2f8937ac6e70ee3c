"""sheldrake.math"""
