"""Comparison of flowborne with analytic and published cases, and its benchmarks."""
