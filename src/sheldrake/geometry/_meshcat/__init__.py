"""The viewer: `Meshcat`, what it draws, its page and its server."""
