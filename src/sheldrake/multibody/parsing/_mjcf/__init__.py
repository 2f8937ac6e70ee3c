"""MJCF to a model description."""
