"""Run folders: what a run leaves behind, checkpoints, resuming. Motion capture in and out (BVH)."""
