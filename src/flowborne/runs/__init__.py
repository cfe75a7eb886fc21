"""Run folders: what a run leaves behind, checkpoints, resuming, summaries."""
