"""From a contact problem to the velocities after the step."""
