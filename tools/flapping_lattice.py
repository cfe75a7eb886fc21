"""The wing of tools/flapping.py by Ptera Software's unsteady vortex lattice: `make cross-checks`.

It runs in an environment of its own, because Ptera Software needs MuJoCo 3.

Takes the wing and its reduced frequencies as JSON, and prints for each the times (s) and lifts (N).
"""

from __future__ import annotations

import json
import math
import sys
import time
from importlib.metadata import version
from typing import Any

from pterasoftware import geometry, movements, operating_point, problems
from pterasoftware.unsteady_ring_vortex_lattice_method import (
    UnsteadyRingVortexLatticeMethodSolver as Solver,
)


def lifts(wing: dict[str, Any], reduced: float) -> dict[str, Any]:
    """Lift over the beats, with the wake carried by the stream alone.

    reduced  reduced frequency, omega chord / (2 speed)
    """
    foil = geometry.airfoil.Airfoil(name=wing["foil"])
    places = ((0.0, 0.0, 0.0), wing["spanwise"]), ((0.0, wing["span"], 0.0), None)
    sections = [
        geometry.wing_cross_section.WingCrossSection(
            airfoil=foil,
            chord=wing["chord"],
            Lp_Wcsp_Lpp=place,
            num_spanwise_panels=panels,
            spanwise_spacing=panels and "uniform",
        )
        for place, panels in places
    ]
    plane = geometry.airplane.Airplane(
        wings=[
            geometry.wing.Wing(
                wing_cross_sections=sections,
                Ler_Gs_Cgs=(0.0, wing["root"], 0.0),
                angles_Gs_to_Wn_ixyz=(0.0, wing["incidence"], 0.0),
                num_chordwise_panels=wing["chordwise"],
                chordwise_spacing="uniform",
            )
        ]
    )
    beating = movements.wing_movement.WingMovement(
        base_wing=plane.wings[0],
        wing_cross_section_movements=[
            movements.wing_cross_section_movement.WingCrossSectionMovement(section)
            for section in plane.wings[0].wing_cross_sections
        ],
        ampAngles_Gs_to_Wn_ixyz=(wing["amplitude"], 0.0, 0.0),
        periodAngles_Gs_to_Wn_ixyz=(math.pi * wing["chord"] / (reduced * wing["speed"]), 0.0, 0.0),
        rotationPointOffset_Gs_Ler=(0.0, -wing["root"], 0.0),
    )
    stream = operating_point.OperatingPoint(rho=wing["density"], vCg__E=wing["speed"], alpha=0.0)
    movement = movements.movement.Movement(
        airplane_movements=[movements.airplane_movement.AirplaneMovement(plane, [beating])],
        operating_point_movement=movements.operating_point_movement.OperatingPointMovement(stream),
        num_cycles=wing["beats"],
    )
    problem = problems.UnsteadyProblem(movement)
    start = time.process_time()
    Solver(problem).run(calculate_streamlines=False, show_progress=False)
    forces = [float(-step.airplanes[0].forces_W[2]) for step in problem.steady_problems]
    times = [float(movement.delta_time * n) for n in range(len(forces))]
    return {"times": times, "lifts": forces, "seconds": time.process_time() - start}


if __name__ == "__main__":
    wing = json.loads(sys.argv[1])
    found = {f"{reduced:g}": lifts(wing, reduced) for reduced in wing["reduced"]}
    print(json.dumps({"version": version("pterasoftware"), "runs": found}))
