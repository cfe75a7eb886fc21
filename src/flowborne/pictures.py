"""Pictures and plots of runs and of measured curves."""

from __future__ import annotations

from flowborne.view.pictures import Picture
from flowborne.view.plots import ChainCost, plot_chain_cost, plot_courses, plot_forces
from flowborne.view.run import Run

__all__ = ["ChainCost", "Picture", "Run", "plot_chain_cost", "plot_courses", "plot_forces"]

__dir__ = __all__.copy
