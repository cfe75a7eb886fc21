"""Errors, words, tables, progress, and files within limits. Knows nothing of physics."""
