"""A run opened in Python: its scene and results, as arrays, tables, plots and films."""

from __future__ import annotations

from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any

from flowborne.base.arguments import PATH, TEXT, or_none, several, takes
from flowborne.base.extras import check_drawing, optional
from flowborne.runs.open_run import StoredRun
from flowborne.runs.run_folder import RunFolder, reading
from flowborne.scenes.load import read_scene
from flowborne.scenes.schema import Scene
from flowborne.view.embedded import Film, run_html

if TYPE_CHECKING:
    import pandas

    from flowborne.view.plots import Plot


class OpenRun(StoredRun):
    """The results of a run, read lazily, in SI units and radians.

    folder  of the run
    raises  RunFolderError when it is not the folder of a run, or has no state yet

    name               of the scene
    tables             the file of the scene as run, as nested dictionaries
    bodies             names of the bodies, the world first
    joints             names of the joints
    dyes               names of the dyes
    frames             frame number of each state, 0 for the start
    frames_per_second  of the run
    is_slab            whether it is two-dimensional, with forces per metre of depth
    grid               of the fluid at the start; None without a fluid
    """

    def __repr__(self) -> str:
        grid = "no fluid" if self.grid is None else self.grid
        return f"OpenRun '{self.name}' in {self.folder}: {self.frames[-1]} frames, {grid}"

    def _repr_html_(self) -> str:
        return run_html(repr(self), self.folder)

    @cached_property
    def scene(self) -> Scene:
        """The scene as run. Its plugins are imported.

        raises  RunFolderError when its file cannot be read
        """
        return read_scene(RunFolder(self.folder).scene)

    @property
    def summary(self) -> dict[str, Any]:
        """summary.json as it is now: outcome, final means, seconds, warnings and notes."""
        with reading(self.folder):
            return RunFolder(self.folder).read_summary()

    def table(self) -> pandas.DataFrame:
        """The history as a pandas DataFrame: a row for each frame, columns named with their units.

        raises  SceneError when pandas is not installed
        """
        library = optional("pandas", "pandas", "xarray", "data frames")
        table: pandas.DataFrame = library.DataFrame(self.history)
        return table.astype({"frame": int}).set_index("frame")

    @takes(columns=several(TEXT, "names of columns"))
    def plot(self, *columns: str) -> Plot:
        """Plot columns of the history over time, a strip for each.

        returns  a figure of Matplotlib, which a notebook shows; `savefig` writes it to a file
        raises   KeyError for an unknown column, ValueError without any; SceneError when Matplotlib
                 is not installed
        """
        optional("matplotlib", "Matplotlib", "film", "plots", "drawn")
        from flowborne.view.plots import plot_columns

        if not columns:
            raise ValueError(f"no column to plot; name some of {', '.join(self.history)}")
        curves = {column: self.history[column] for column in columns}
        return plot_columns(self.history["time_s"], curves)

    @takes(out=or_none(PATH))
    def film(self, out: str | Path | None = None) -> Film:
        """Draw the run, or give the film that it has.

        out      film.mp4, film.webp, or frames.png for a sequence of images; by default
                 preview.mp4 in its folder, which is drawn only if there is none
        returns  the file, which a notebook shows
        raises   SceneError when a library for it is not installed; ValueError for another ending,
                 or a run of one frame; OSError if the file cannot be written
        """
        path = RunFolder(self.folder).film if out is None else Path(out)
        if out is not None or not path.exists():
            check_drawing()
            from flowborne.view.film import make_preview, write_shot

            if out is None:
                make_preview(self.folder)
            else:
                write_shot(self.folder, path)
        return Film(path)


def open_run(folder: str | Path) -> OpenRun:
    """The results of a run: scene, times, poses, skin of flesh, fields and history, read lazily.

    folder  of a run, which may still be in progress
    raises  RunFolderError when it is not the folder of a run, or has no state yet
    """
    return OpenRun(folder)
