"""The map of a run in three dimensions, rendered by VTK without a screen."""
