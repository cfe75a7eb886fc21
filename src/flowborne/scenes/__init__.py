"""Scene files: schema, loading, building a world, prescribed motions, the built-in scenes."""
