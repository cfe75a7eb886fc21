"""Import of rigged characters: read from a file, divided into bodies, written as a scene.

rig        a skeleton at rest, its surface and its clips, from any file
limits     limits of a character, checked before expensive work
source     the reader of a file, by its extension
gltf       .glb and .gltf: gltf_document types its tables, gltf_buffers reads arrays and colours
apart      another process that reads a file, which may crash
fbx        .fbx, which Assimp converts to glTF in another process
usd        UsdSkel, through usd-core: usd_gate opens a file, after another process has read it
division   the joints that become bodies, and the closed piece of the surface of each
flesh      cores of bodies of flesh, and the surface that the flesh fills
model      these bodies as MJCF with the surface as a skin, and their motion in a clip
folder     all of this as a folder that `flowborne run` accepts
"""
