"""From q and v to poses, velocities, forces and accelerations of a tree of bodies."""
