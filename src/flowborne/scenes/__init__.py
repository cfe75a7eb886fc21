"""Scene files: schema, loading, building a world from them, prescribed motions, the built-in scenes."""
