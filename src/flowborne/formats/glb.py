"""A run as binary glTF, by pygltflib."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from flowborne.base.atomic import replaced_whole
from flowborne.base.extras import optional
from flowborne.formats.creature import Creature
from flowborne.formats.morphs import morphed
from flowborne.runs.exporters import Written, provided
from flowborne.runs.open_run import OpenRun

TOLERANCE = 1e-6
"""Error of flesh below which no morph target is added, in sizes of the creature."""


@provided(".glb")
@dataclass(frozen=True)
class ExporterGlb:
    """Skinned meshes on an animated skeleton; morph targets correct the skinning error of flesh.

    targets  maximum number of morph targets per flesh
    """

    targets: int = 64

    def __post_init__(self) -> None:
        if self.targets < 0:
            raise ValueError(f"targets is {self.targets}. Give 0 or more")

    def write(self, run: OpenRun, path: Path) -> Written:
        optional("pygltflib", "pygltflib", "gltf", f"'{path.suffix}' files")
        from flowborne.formats.glb_file import INFLUENCES, write_glb

        creature = Creature(run)
        tolerance = TOLERANCE * creature.size
        skins = {
            skin.name: morphed(creature, skin, INFLUENCES, self.targets, tolerance)
            for skin in creature.skins
        }
        with replaced_whole(path) as new:
            write_glb(creature, skins, new)
        notes = (
            f"flesh '{name}': {len(skin.targets)} morph targets, at most {skin.error:.2g} m from "
            f"the run; {skin.unmorphed:.2g} m by skinning alone"
            for name, skin in skins.items()
        )
        return Written((path,), "; ".join(notes))
