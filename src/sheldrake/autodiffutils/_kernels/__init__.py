"""Numbers with derivatives in machine code."""
