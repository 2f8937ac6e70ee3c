"""Questions to a QueryObject: where geometry is, what touches, what a camera sees."""
