"""Studies: many runs of one scene over its keys, their table, plots, and optima.

A study varies keys of a scene (`schema`). Its samples (`sampling`) are each run with one or several
resolutions; each such run is a member (`members`). `running` runs the members that are not on the
disc yet, `result` makes the table of all, `page` its HTML page.
"""
