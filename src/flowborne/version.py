"""The version, apart from the public face, so that rooms below it can write it down."""

__version__ = "0.1.0"
