"""MathematicalProgram, put together from one file a subject."""
