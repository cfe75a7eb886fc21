"""Exporters that flowborne brings, one module a format; libraries that one needs load with it.

They read run folders, and the model that the folder's scene describes, and never a live solver.
A new one is a module here, and its ending in `flowborne.runs.exporters.FORMATS`.
"""
