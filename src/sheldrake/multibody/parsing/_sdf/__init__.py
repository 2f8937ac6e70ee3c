"""SDFormat to model descriptions."""
