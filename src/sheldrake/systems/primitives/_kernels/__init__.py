"""What the blocks of `systems.primitives` compute: rows that the event loop calls."""
