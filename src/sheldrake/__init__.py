"""Drake's modelling system for robots, in Python all the way down."""

__version__ = "0.1.0.dev0"
