"""Block diagrams: the framework, ready-made blocks, controllers, sensors, and what simulates and analyses them.

Nothing lives here itself; import from the modules below, or everything from `sheldrake.systems.all`.
"""
