"""One context of a plant: its state, and the questions that positions and velocities answer."""
