"""The controller: objectives, gradients, step rules, schedule, executors.

Knows only a world that can be copied, stepped and measured. Paper: sections 2, 3 and 4.3
(eq. 10).
"""
