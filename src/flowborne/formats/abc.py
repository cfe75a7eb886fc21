"""A run as an Alembic cache, by alembic3d."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from flowborne.extras import optional
from flowborne.files.atomic import replaced_whole
from flowborne.formats.creature import Creature
from flowborne.runs.exporters import provided
from flowborne.runs.open_run import OpenRun


@provided(".abc")
@dataclass(frozen=True)
class ExporterAbc:
    """Geometries under transforms that move, flesh as a mesh that deforms; see `abc_archive`."""

    def write(self, run: OpenRun, path: Path) -> None:
        optional("alembic3d", "alembic3d", "alembic", f"'{path.suffix}' files")
        from flowborne.formats.abc_archive import write_archive

        creature = Creature(run)
        with replaced_whole(path) as new:
            write_archive(creature, new)
