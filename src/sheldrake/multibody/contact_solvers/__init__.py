"""Contact and constraint solvers of the discrete plant: what they are given, and what their status means."""
