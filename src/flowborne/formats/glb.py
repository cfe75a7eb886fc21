"""A run as binary glTF, by pygltflib."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from flowborne.extras import optional
from flowborne.files.atomic import replaced_whole
from flowborne.formats.creature import Creature
from flowborne.formats.morphs import morphed
from flowborne.runs.exporters import Written, provided
from flowborne.runs.open_run import OpenRun

NEAR = 1e-6
"""Distance from the run at which flesh has enough morph targets, in sizes of the creature."""


@provided(".glb")
@dataclass(frozen=True)
class ExporterGlb:
    """Skinned meshes on a skeleton that moves; flesh has morph targets for what skinning lacks.

    targets  largest number of morph targets for a flesh
    """

    targets: int = 64

    def __post_init__(self) -> None:
        if self.targets < 0:
            raise ValueError(f"targets is {self.targets}. Give 0 or more")

    def write(self, run: OpenRun, path: Path) -> Written:
        optional("pygltflib", "pygltflib", "gltf", f"'{path.suffix}' files")
        from flowborne.formats.glb_file import INFLUENCES, write_glb

        creature = Creature(run)
        near = NEAR * creature.size
        skins = {
            skin.name: morphed(creature, skin, INFLUENCES, self.targets, near)
            for skin in creature.skins
        }
        with replaced_whole(path) as new:
            write_glb(creature, skins, new)
        told = (
            f"flesh '{name}': {len(skin.targets)} morph targets, at most {skin.error:.2g} m from "
            f"the run; {skin.unmorphed:.2g} m by skinning alone"
            for name, skin in skins.items()
        )
        return Written((path,), "; ".join(told))
