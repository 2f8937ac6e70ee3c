"""URDF to a model description."""
