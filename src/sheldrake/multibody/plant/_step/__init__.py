"""How a plant advances, by steps or by derivatives, and what that leaves for its ports to report."""
