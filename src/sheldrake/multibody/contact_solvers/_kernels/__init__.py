"""From a contact problem to the velocities after the step. To be read in this order:

problem   what a solve is made of, and products with it: A x, J v, J^T gamma, J diag(1/A) J^T
laws      what contacts and scalar rows do: material, normal force, friction; what they prepare, impulse, cost
factor    the sparse factor of an island's matrix: order of elimination, layout, elimination
cost      the convex cost of an island: value, gradient, Hessian
newton    its minimum, as Drake iterates or until what can rest does
tamsi     kTamsi, which solves no convex problem
solve     who takes part, islands, the stages of a step, and the table of approximations
status    what a solve can answer
"""
