"""Rigged characters from other programs: read from a file, cut into bodies, written as a scene.

rig        a skeleton at rest, the surface that it carries, and how a clip moves it
source     a file as one of those, by its ending
limits     what a character may ask for before anything is made of it
gltf       .glb and .gltf: gltf_document types its tables, gltf_accessors holds every array against
           its buffer, gltf_gate checks the document whole
usd        UsdSkel, by usd-core: usd_gate checks files, topology and influences, usd_probe has a
           binary file read first by usd_process, which may end by it
pose       a clip on the skeleton of a character, and what of it rigid bodies can follow
division   which joints become bodies, and the closed piece of the surface that each of them gets
model      those bodies as MJCF, with the surface as a skin that MuJoCo and the exporters know
folder     all of it as a folder that `flowborne run` takes
"""
