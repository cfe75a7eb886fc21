"""The fluid: MAC grid, boundaries, advection, viscosity, projection, carried scalars.

Knows no solids. Paper: section 4 (incompressible flow) and the time step of section 6.
"""
