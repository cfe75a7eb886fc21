"""The figures by which people trim: what a body displaces, and where it ends up."""

from __future__ import annotations

import re
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
import trimesh

import flowborne as fb
from flowborne.coupling.flesh import hydrostatic_push
from flowborne.scenes.build import build
from flowborne.scenes.creature import creature_of
from flowborne.scenes.load import load_scene
from flowborne.scenes.seen import seen_bodies
from flowborne.scenes.warn import warnings_of
from flowborne.solids.dynamics import kinematics
from flowborne.solids.enclosed import enclosing_geoms
from flowborne.solids.mjcf import bones_of
from flowborne.solids.model import SolidModel
from flowborne_validation.worlds import mjcf

SCENE = """
gravity = [0.0, 0.0, -9.81]
[time]
frames_per_second = 50.0
frames = 60
[domain]
size = [0.6, 0.6, 0.6]
resolution = 24
[fluid]
density = 1000.0
[solids]
model = "box.xml"
"""

BOX = (
    '<body name="box" pos="0.3 0.3 0.3"><freejoint name="drift"/>'
    '<geom type="box" size="0.05 0.05 0.05" density="{density}"/>{inside}</body>'
)

Written = Callable[..., Path]


@pytest.fixture
def written(tmp_path: Path) -> Written:
    """The scene of a cube of 0.1 m in 0.6 m of water."""

    def written(
        density: float = 1000.0,
        inside: str = "",
        rest: str = "",
        more: str = "",
        scene: str = SCENE,
    ) -> Path:
        world = BOX.format(density=density, inside=inside)
        model = f"<mujoco><worldbody>{world}{rest}</worldbody>{more}</mujoco>"
        (tmp_path / "box.xml").write_text(model)
        (tmp_path / "box.toml").write_text(scene)
        return tmp_path / "box.toml"

    return written


def warned(path: Path, settings: dict[str, str] | None = None) -> list[str]:
    scene = load_scene(path, settings or {})
    return warnings_of(scene, build(scene).world.setup)


@pytest.mark.parametrize("resolution", [12, 24, 48])
def test_a_cube_displaces_its_volume_whatever_the_grid_is(
    written: Written, resolution: int
) -> None:
    """The grid's own volume stands beside it where it is off by more than 2 %."""
    text = SCENE.replace(
        "size = [0.6, 0.6, 0.6]", "lower = [0.01, 0.02, 0.03]\nupper = [0.61, 0.62, 0.63]"
    )
    scene = load_scene(written(scene=text), {"domain.resolution": str(resolution)})
    creature = creature_of(scene, build(scene).world.setup)
    assert creature is not None
    assert creature.displaced_mass == pytest.approx(1.0, rel=1e-12)
    cells = creature.displaced_on_grid
    assert cells is not None
    beside = f" ({cells:.3g} kg on the grid)" if abs(cells - 1.0) > 0.02 else ""
    assert creature.lines()[0] == (
        f"creature: 1 kg, displaces 1 kg of fluid{beside}, 0.1 x 0.1 x 0.1 m"
    )
    assert bool(beside) == (resolution == 12)


def test_on_geoms_of_the_world_no_buoyancy_acts(written: Written) -> None:
    path = written()
    (path.parent / "box.xml").write_text(
        '<mujoco><worldbody><geom size="0.1" pos="0.3 0.3 0.3"/></worldbody></mujoco>'
    )
    scene = load_scene(path)
    creature = creature_of(scene, build(scene).world.setup)
    assert creature is not None
    assert creature.displaced_mass is None
    assert creature.lines()[0] == "creature: 0 kg, 0.2 x 0.2 x 0.2 m"


def test_flesh_displaces_what_its_skin_encloses() -> None:
    """Buoyancy is the force of the pressure on that skin."""
    scene = load_scene("swimmer-jet-only")
    setup = build(scene).world.setup
    creature, flesh = creature_of(scene, setup, on_grid=False), setup.solid.flesh
    assert creature is not None
    assert flesh is not None
    vertices = kinematics(setup.solid, setup.solid.rest().q).vertices
    down = np.array([0.0, 0.0, -10.0])
    push = hydrostatic_push(vertices, flesh.surface, down, 1.0).reshape(-1, 3).sum(axis=0)
    assert setup.fluid is not None
    assert creature.displaced_mass == pytest.approx(setup.fluid.density * push[2] / 10.0, rel=1e-9)


LEAD = '<geom name="lead" type="sphere" size="0.01" density="9000"/>'
WEIGHT = f'<body name="weight">{LEAD}</body>'


@pytest.mark.parametrize("inside", [LEAD, WEIGHT])
def test_of_ballast_inside_a_hull_no_thickness_is_measured(written: Written, inside: str) -> None:
    scene = load_scene(written(900.0, inside))
    assert [one.sentence() for one in seen_bodies(build(scene).world.setup)] == [
        "box: 0.1 m thick, 4 cells"
    ]


def test_ballast_that_sticks_out_is_measured(written: Written) -> None:
    out = '<geom type="sphere" size="0.01" pos="0.05 0 0" density="9000"/>'
    (seen,) = seen_bodies(build(load_scene(written(900.0, out))).world.setup)
    assert seen.thickness == pytest.approx(0.02)


def test_ballast_in_a_mesh_is_found(tmp_path: Path) -> None:
    """A hollow of the hull is not inside it."""
    hull = trimesh.creation.annulus(0.1, 0.2, 0.3)
    hull.export(tmp_path / "hull.stl")
    for place, held in (("0.15 0 0", [-1, 0]), ("0 0 0", [-1, -1])):
        model = mjcf(
            '<body name="ring"><freejoint/><geom type="mesh" mesh="hull"/>'
            f'<geom type="sphere" size="0.02" pos="{place}"/></body>'
        ).replace("<worldbody>", '<asset><mesh name="hull" file="hull.stl"/></asset><worldbody>')
        (tmp_path / "ring.xml").write_text(model)
        _, mj = bones_of(tmp_path / "ring.xml", False, (0.0, 0.0, 0.0))
        assert enclosing_geoms(SolidModel(mj, False)).tolist() == held


def test_buoyancy_on_ballast_of_its_own_body_is_warned_of_and_taken_away(written: Written) -> None:
    path = written(963.0, WEIGHT)
    (warning,) = warned(path)
    assert warning.startswith("[solids]: 'weight' lies inside 'box', where no fluid meets it, and")
    remedy = re.search(r"displace\.without = (\[.*\]) ", warning)
    assert remedy
    dry = {"solids.displace.without": remedy[1].replace("'", '"')}
    assert warned(path, dry) == []
    scene = load_scene(path, dry)
    creature = creature_of(scene, build(scene).world.setup, on_grid=False)
    assert creature is not None
    assert creature.displaced_mass == pytest.approx(1.0)
    assert creature.mass == pytest.approx(0.963 + 9000.0 * 4.0 / 3.0 * np.pi * 0.01**3)


def test_a_light_body_is_pinned_under_a_closed_top_when_it_is_said_to_be(written: Written) -> None:
    """The time is right to a fifth; half of it ends in open water."""
    path = written(500.0)
    (warning,) = warned(path)
    said = re.search(
        r"'box' of 0\.5 kg is lighter than the 1 kg of fluid in its place: it is pinned under the "
        r"closed side z_max about ([\d.]+) s after the start, as there is no free surface; with 1 "
        r"kg it stays where it is, and time\.frames = (\d+) ends before",
        warning,
    )
    assert said
    with fb.Simulation(path) as simulation:
        while simulation.body("box").position[2] < 0.54:
            simulation.advance_frame()
        assert simulation.time == pytest.approx(float(said[1]), rel=0.2)
    assert warned(path, {"time.frames": said[2]}) == []
    assert warned(written(1000.0)) == []


@pytest.mark.parametrize(
    ("joints", "pinned"),
    [
        ('<freejoint name="drift"/>', True),
        ('<joint type="slide" axis="1 0 0"/><joint type="slide" axis="0 1 0"/>', True),
        ('<joint type="slide" axis="0 1 0" range="-0.1 0.1"/>', False),
        ('<joint type="slide" axis="0 1 0" stiffness="100"/>', False),
        ('<joint type="slide" axis="1 0 0"/>', False),
    ],
)
def test_a_body_in_a_slab_rises_if_a_joint_lets_it(
    written: Written, joints: str, pinned: bool
) -> None:
    scene = SCENE.replace("[0.0, 0.0, -9.81]", "[0.0, -9.81]").replace("0.6, 0.6, 0.6", "0.6, 0.6")
    path = written(500.0, scene=f"dimensions = 2\n{scene}")
    model = (path.parent / "box.xml").read_text().replace('<freejoint name="drift"/>', joints)
    (path.parent / "box.xml").write_text(model)
    found = [warning for warning in warned(path) if "pinned" in warning]
    assert len(found) == pinned
    if found:
        assert "'box' of 5 kg/m is lighter than the 10 kg/m of fluid" in found[0]
        assert "side y_max about 0.4" in found[0]


CHAIN = (
    '<body name="anchor" pos="0.3 0.3 0.05"><geom type="sphere" size="0.03"/><site name="low"/>'
    "</body>"
)


@pytest.mark.parametrize(
    ("more", "settings"),
    [
        ("", {"boundaries.z_max": "open"}),
        ("", {"gravity": "[0.0, 0.0, 0.0]"}),
        ("<equality><connect body1='box' body2='anchor' anchor='0 0 -0.1'/></equality>", {}),
        (
            "<tendon><spatial limited='true' range='0 0.3'><site site='low'/><site site='high'/>"
            "</spatial></tendon>",
            {},
        ),
    ],
)
def test_bodies_that_reach_no_lid(written: Written, more: str, settings: dict[str, str]) -> None:
    found = warned(written(500.0, '<site name="high"/>', rest=CHAIN, more=more), settings)
    assert not any("pinned" in warning for warning in found)
