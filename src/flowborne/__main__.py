"""`python -m flowborne` is the command `flowborne`."""

from flowborne.cli import main

main()
