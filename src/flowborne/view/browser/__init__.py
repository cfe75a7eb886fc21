"""The viewer of a run in a browser, by viser: what a film shows, from any side and at any time.

`viewer` opens and serves it, `panel` holds the controls, `timeline` the time, `growing` the run;
each of the other modules puts one thing into the scene.
"""
