"""The human of Figs. 5 and 9: 23 rigid bodies, and a synthetic walk.

skeleton, clip_skeleton   joint positions at rest, by published proportions or from the bones of a
                          clip
segments                  masses, centres of mass and inertias (de Leva 1996)
shapes, body              geometries of the bodies, and the MJCF of the human
posture, soles            the standing pose of a clip, and the floor under its feet
gait                      a walk from normative joint angles
"""
