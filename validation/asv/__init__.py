"""The benches as a suite of asv: `make bench-history`."""
