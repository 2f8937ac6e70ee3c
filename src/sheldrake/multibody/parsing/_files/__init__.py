"""What every format stands on: messages with their place, XML, packages and their downloads."""
