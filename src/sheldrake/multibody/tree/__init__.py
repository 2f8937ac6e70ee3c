"""sheldrake.multibody.tree"""
