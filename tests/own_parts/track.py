"""An exporter: where a body was, every so many frames."""

from dataclasses import dataclass

import numpy as np

from flowborne.parts import OpenRun, exporter


@exporter(".track")
@dataclass(frozen=True)
class Track:
    body: str
    every: int = 1

    def write(self, run: OpenRun, path) -> None:
        places = run.every("body_position")[:: self.every, run.bodies.index(self.body)]
        np.savetxt(path, places)
