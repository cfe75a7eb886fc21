"""Flesh around bones: tetrahedra inside a surface, held where they meet the bones.

bones         signed distance to the bones at rest, and closed surfaces at a distance from them
surface_file  the user's own closed surface
symmetry      mirror planes that exchange bones, and the part of space that is meshed between them
mesh_run      the separate process that meshes and reads meshes, because both may crash
mesh          tetrahedra, which of them are elastic, and which points a bone holds
mesh_file     the file in which a run keeps its flesh
growth        a mesh as quadratic elements of a model
"""
