"""The engine: a diagram flattened into rows, the memory they work on, and when a row is out of date."""
