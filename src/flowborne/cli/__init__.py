"""The command `flowborne`, and what it prints."""
