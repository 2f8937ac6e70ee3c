"""Programs that are easier to solve than the one they stand for."""
