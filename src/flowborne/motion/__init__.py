"""Prescribed motion of joints: clips, keyframes and formulas. Uses no scene and no fluid.

bvh_file, bvh                 motion capture (BVH) in and out
clip                          a skeleton of rigid bones and its motion
quaternions                   unit quaternions in arrays
mapping                       joints of the human -> joints of a clip
clip_reading                  the clip of a file, with its unit, up axis and mapping
human/                        the human of Figs. 5 and 9, and a synthetic walk
clip_curves, clip_motion,
clip_following                the prescribed motion of a model's joints from a clip
tracks, formula, inflow       curves, keyframes and formulas in time, and inflow profiles
"""
