"""Built-in exporters, one module per format, which imports its library when it writes a file.

They read run folders and the model of the folder's scene, never a live solver. To add one, add a
module here whose class has the decorator `flowborne.runs.exporters.provided`.
"""
