# SPDX-License-Identifier: GPL-3.0-or-later
"""Blender extension: bones of a character react to wind or water, computed by flowborne.

process      child processes, one after the other
environment  the Python environment of flowborne, found or made
job          a run of flowborne; files are exchanged, nothing else
reaction     the settings of a run, and the scene file made of them
presets      bones by their names
motion       what a run gives, and the rotation of bones in it
settings     what the user sets for an armature
keys         actions and their keys
stand_in     a copy of a character with its deforming bones alone
character    armature, meshes and settings from a Blender scene
bake         a run as an action on the NLA
jobs         the jobs of this session, and those next to the .blend
nodes        groups of geometry nodes
forces       forces of a run as points with attributes
flesh        flesh of a run on the meshes of a character
ink          the ink of a run as a volume
ghost        a copy of a character that plays the frames of a run so far
operators    what the buttons do
panel        the panel, and the preferences

The first six do not import Blender.
"""


def register() -> None:
    """Called by Blender when the extension is enabled."""
    from . import panel

    panel.register()


def unregister() -> None:
    """Called by Blender when the extension is disabled."""
    from . import panel

    panel.unregister()
