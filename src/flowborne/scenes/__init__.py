"""Scene files: schema, loading, building a world, prescribed motions, the built-in scenes.

`human` makes the paper's walker; capture, mapping and clip_... lead joints along a clip, and
motion_out gives the clip back as it came out.
"""
