"""The viewer of a run in a browser, by viser: what a film shows, from any viewpoint at any time.

`viewer` opens and serves it, `panel` has the controls and `settings` their state. The other modules
each put one thing into the scene.
"""
