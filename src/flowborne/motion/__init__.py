"""Prescribed motion of joints: clips, keyframes and formulas. Uses no scene and no fluid.

bvh_file, bvh                 motion capture (BVH) in and out
clip                          a skeleton of rigid bones and its motion
mapping                       which joint of a clip drives which joint of the human
clip_reading                  the clip of a file: its unit, its up axis, its mapping
human/                        the human of Figs. 5 and 9, and a synthetic walk
clip_curves, clip_motion,
clip_following                the motion that a clip gives to the joints of a model
tracks, formula, inflow       curves, keyframes and formulas of time and place, with derivatives
"""
