"""Bodies in the fluid: geometry on the grid, the operators between both, the monolithic solve, the step.

Paper: section 4.2 (eqs. 5-9) and the time step of section 6.
"""
