"""Who solves programs: interfaces to libraries, solvers of our own, and the choice among them."""
