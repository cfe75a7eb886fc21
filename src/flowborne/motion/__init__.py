"""How joints are told to move: clips, keyframes and formulas. Knows no scene and no fluid.

bvh_hierarchy, bvh_file, bvh   motion capture (BVH) in and out
clip, euler                    a motion of joints in time, and rotations in any order of axes
clip_reading                   the clip of a file: its unit, its axis up, which joint is which
clip_scale, mapping            the unit that makes a person, and names of joints of many programs
human/                         the human of Figs. 5 and 9, and a walk of its own
clip_curves, clip_motion,
clip_following, clip_loop,
clip_seam                      the motion that a clip gives to the joints of a model
tracks, formula, dual, inflow  curves, keyframes and formulas of time and place, with derivatives
"""
