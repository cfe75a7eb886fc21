"""A simulation that runs live in the browser viewer, with controls for what can change in a run.

`playing` advances it, goes back and records. `controls` turns settings into changes of the scene,
with the objectives of `groups`. `memory` keeps the frames as a run, and `viewer` with `panel` shows
them.
"""
