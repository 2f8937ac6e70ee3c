"""What a model file says, whatever its format, and the checks of the whole."""
