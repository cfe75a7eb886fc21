"""Scene files: tables, loading, checks, warnings and notes, building a world, built-in scenes.

Joints follow a clip by `capture` and an earlier run by `earlier`; `motion_out` writes the motion of
a run as BVH. Called, it lists the built-in scenes: see `listing.scenes`.
"""

from flowborne.base.called import calls

calls(__name__, "flowborne.scenes.listing", "scenes")
