"""Building a plant: what is registered before Finalize(), and the model made of it."""
