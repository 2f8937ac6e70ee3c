"""sheldrake.multibody.parsing"""
