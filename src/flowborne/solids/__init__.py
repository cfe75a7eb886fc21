"""The articulated body and its flesh: model, assembled A and b, prescribed joints, effort, wind.

A model with flesh is assembled sparsely (tissue, elements, elasticity, flesh, flesh_dynamics,
flesh_solve); `driven` is the interface of both kinds for the coupling.

No module here uses the fluid. Paper: sections 2 and 3 (eqs. 1-4), rigid clusters of sections 3.3
and 5.
"""

from flowborne.solids.engine import check_engine

check_engine()
