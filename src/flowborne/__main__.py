"""`python -m flowborne` is the command `flowborne`."""

from flowborne.cli.main import main

main()
