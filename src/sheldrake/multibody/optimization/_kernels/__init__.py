"""Loops of optimization that run as machine code."""
