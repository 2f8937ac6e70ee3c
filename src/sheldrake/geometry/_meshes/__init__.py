"""Meshes: files, surfaces, volumes, hulls and fields on them."""
