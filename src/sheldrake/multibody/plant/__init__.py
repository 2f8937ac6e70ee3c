"""sheldrake.multibody.plant"""
