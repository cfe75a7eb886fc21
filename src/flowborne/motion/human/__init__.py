"""The human of Figs. 5 and 9: 23 rigid bodies, and a walk of its own.

skeleton, standard, clip_skeleton   where the joints are at rest: by published proportions, or
                                    from the bones of a clip
segments, inertia                   masses, centres of mass and inertias (de Leva 1996)
shapes, body                        the outer form, and the whole as MJCF
gait_curves, gait                   a walk from normative joint angles, and standing
"""
