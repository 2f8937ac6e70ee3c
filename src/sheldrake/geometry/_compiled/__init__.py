"""From geometry state to the arrays of the contact kernels, and which kernels a scene needs."""
