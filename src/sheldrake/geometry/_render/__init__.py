"""Cameras and the engines that make pictures for them."""
