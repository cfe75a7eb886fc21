"""The fluid: MAC grid, boundaries, advection, viscosity, pressure, carried scalars.

Knows no solids. Paper: section 4.1 (incompressible flow) and items 1-5 of section 6.
"""
