"""Bodies in the fluid: geometry on the grid, the operators between both, the solve, the step.

Paper: section 4.2 (eq. 9) and the time step of section 6. Signs: the pressure wrench on a body
is the force and the torque about the world origin that the fluid exerts on it; a face's normal
points along its axis.
"""
