"""flowborne: creatures that answer the fluid around them."""

__version__ = "0.1.0"
