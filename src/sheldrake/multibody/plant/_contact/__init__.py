"""What a plant reports about contact."""
