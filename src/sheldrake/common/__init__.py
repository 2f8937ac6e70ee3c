"""sheldrake.common"""
