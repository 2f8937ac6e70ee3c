"""Functions of decision variables: costs and constraints of known shape, and what binds them to variables."""
