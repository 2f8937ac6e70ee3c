"""sheldrake.multibody.contact_solvers"""
