"""The plant's own stages: from contacts to a contact problem, and from its solution to the next state."""
