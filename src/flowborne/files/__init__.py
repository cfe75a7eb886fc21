"""Files: those of users are read within limits, our own are written atomically."""
