"""The hydroelastic representation of geometry."""
