"""Flesh around bones: tetrahedra inside a surface, held where they meet the bones.

bones                what the bones fill at rest, as a signed distance
contour              the closed surface at some distance from them
surface_file         the user's own closed surface
symmetry             mirror planes that exchange bones, and what is meshed between them
mesher               tetrahedra inside a surface, by fTetWild
mesh_run, apart      the process that meshes and reads meshes, and may die of them
mesh                 flesh: what of the tetrahedra is elastic, and which points a bone holds
mesh_file            the file in which a run keeps its flesh
growth               such a mesh as quadratic elements of a model
"""
