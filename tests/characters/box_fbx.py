"""How box.fbx was made, in the Python of Blender 5.0: python box_fbx.py box.glb box.fbx

box.glb is written by rigged.write_glb. Blender keeps its joints, weights, material and clip.
"""

from __future__ import annotations

import sys

import bpy

bpy.ops.wm.read_factory_settings(use_empty=True)
bpy.ops.import_scene.gltf(filepath=sys.argv[1])
bpy.ops.export_scene.fbx(filepath=sys.argv[2], add_leaf_bones=False, bake_anim_simplify_factor=0.0)
