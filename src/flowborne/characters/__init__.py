"""Rigged characters from other programs: read from a file, cut into bodies, written as a scene.

rig        a skeleton at rest, its surface and its clips, of any file
limits     of a character, checked before the work
source     the reader of a file, by its ending
gltf       .glb and .gltf: gltf_document types its tables, gltf_buffers reads arrays and colours,
           gltf_gate checks the whole document
usd        UsdSkel, by usd-core: usd_gate checks files, topology and influences, and runs
           usd_process, which reads a binary file first and may crash
division   the joints that become bodies, and the closed piece of the surface of each
model      those bodies as MJCF with the surface as a skin, and their motion in a clip
folder     all of it as a folder that `flowborne run` takes
"""
