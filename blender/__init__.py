# SPDX-License-Identifier: GPL-3.0-or-later
"""Blender extension: bones of a character react to wind or water, computed by flowborne.

job        a run of flowborne as a child process; files are exchanged, nothing else
reaction   the settings of a run, and the scene file made of them
presets    bones by their names
motion     what a run gives, and the rotation of bones in it
character  armature, meshes and settings from a Blender scene
bake       a run as an action on the NLA
panel      properties, operators and the panel

`job`, `reaction`, `presets` and `motion` do not import Blender.
"""


def register() -> None:
    """Called by Blender when the extension is enabled."""
    from . import panel

    panel.register()


def unregister() -> None:
    """Called by Blender when the extension is disabled."""
    from . import panel

    panel.unregister()
