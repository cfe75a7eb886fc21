"""What every Python imports first that the tests start: see `PROCESSES` in conftest.py.

An import of flowborne makes 300,000 objects that stay. Half a second of each process is spent on
looking for garbage among them, most of it at its end.
"""

import atexit
import gc

gc.set_threshold(50_000)
atexit.register(gc.freeze)
