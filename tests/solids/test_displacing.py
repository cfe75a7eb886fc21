"""Which geoms displace fluid, in models built as those of others are."""

from __future__ import annotations

import numpy as np
import pytest

from flowborne.solids.displacing import BY_RULE, Displace
from flowborne.solids.mjcf import Given, bones_of
from flowborne.solids.model import SolidModel

# a tetrahedron, and one without its last face
MESHES = """<asset>
<mesh name="shell" vertex="0 0 0 1 0 0 0 1 0 0 0 1" face="0 2 1 0 1 3 1 2 3 0 3 2"/>
<mesh name="torn" vertex="0 0 0 1 0 0 0 1 0 0 0 1" face="0 2 1 0 1 3 1 2 3"/></asset>"""

DEFAULTS = """<default>
<default class="visual"><geom contype="0" conaffinity="0" group="2" mass="0"/></default>
<default class="collision"><geom group="3"/></default></default>"""

WORLD = "<geom name='floor' type='plane' size='1 1 1'/><geom name='rock' size='.1' group='2'/>"
BODY = "<body><freejoint/><inertial mass='1' pos='0 0 0' diaginertia='1 1 1'/>"
FIN = "<geom name='fin' size='.1' contype='0' conaffinity='0'/>"


def displacing(geoms: str, displace: Displace = BY_RULE) -> list[str]:
    """Names of the geoms that displace, of one body that floats above a floor with a rock."""
    xml = f"<mujoco>{DEFAULTS}{MESHES}<worldbody>{WORLD}{BODY}{geoms}</body></worldbody></mujoco>"
    mj = bones_of(xml, False, (0, 0, 0), Given(displace=displace))[1]
    return list(SolidModel(mj, False).geom_names)


DRAWN = "<geom name='hull' class='visual' type='mesh' mesh='shell'/>"
OPEN = "<geom name='hull' class='visual' type='mesh' mesh='torn'/>"
EYE = "<geom name='eye' class='visual' size='.05'/>"
BUMPER = "<geom name='bumper' class='collision' type='capsule' size='.2 .3'/>"


@pytest.mark.parametrize(
    ("geoms", "found"),
    [
        (DRAWN + BUMPER, ["hull"]),
        (OPEN + BUMPER, ["bumper"]),
        (EYE + BUMPER, ["bumper"]),
        (BUMPER, ["bumper"]),
        (DRAWN, ["hull"]),
        ("<geom name='bone' size='.3' contype='0' conaffinity='0' group='5'/>", []),
        # a fin that does not collide belongs to the trunk beside it
        ("<geom name='trunk' size='.3'/>" + FIN, ["trunk", "fin"]),
        # what collides in group 0, what is drawn in group 1
        ("<geom name='bumper' size='.5'/>" + DRAWN.replace("class", "group='1' class"), ["bumper"]),
        ("<geom name='bumper' size='.3'/>" + DRAWN.replace("class", "group='1' class"), ["hull"]),
    ],
)
def test_of_each_body_one_set_displaces(geoms: str, found: list[str]) -> None:
    assert displacing(geoms) == ["rock", *found]


@pytest.mark.parametrize(
    ("displace", "found"),
    [
        (Displace(groups=(3,)), ["bumper"]),
        (Displace(classes=("visual",)), ["hull"]),
        (Displace(names=("b*", "rock")), ["rock", "bumper"]),
        (Displace(without=("rock",)), ["hull"]),
        (Displace(classes=("collision", "visual"), without=("h*",)), ["bumper"]),
    ],
)
def test_a_scene_chooses_by_group_class_and_name(displace: Displace, found: list[str]) -> None:
    assert displacing(DRAWN + BUMPER, displace) == found


@pytest.mark.parametrize(
    ("displace", "message"),
    [
        (Displace(groups=(4,)), r"the group '4'\. There are: 2, 3\."),
        (Displace(classes=("skin",)), r"the class 'skin'\. There are: main, visual, collision\."),
        (Displace(without=("floor",)), r"the name 'floor'\. There are: rock, hull, bumper\."),
    ],
)
def test_what_names_nothing_is_refused(displace: Displace, message: str) -> None:
    with pytest.raises(ValueError, match=message):
        displacing(DRAWN + BUMPER, displace)


SPHERE = 4.0 / 3.0 * np.pi * 0.5**3


@pytest.mark.parametrize(
    ("geoms", "mass"),
    [
        ("<geom size='.5'/>", 100.0 * SPHERE),
        ("<geom size='.5' density='300'/>", 100.0 * SPHERE),
        ("<geom size='.5' mass='2'/>", 2.0),
        ("<geom size='.5'/><geom size='.6' group='3'/>", 100.0 * SPHERE),
        ("<geom size='.5'/><geom size='.6' group='3' mass='7'/>", 100.0 * SPHERE + 7.0),
        ("<geom size='.5' mass='0'/><geom size='.6' group='3'/>", 100.0 * 1.728 * SPHERE),
        ("<geom size='.5' mass='0'/><geom size='.6' group='3' mass='7'/>", 7.0),
    ],
)
def test_a_mass_wins_over_the_scenes_density_and_that_over_the_models(
    geoms: str, mass: float
) -> None:
    xml = f"<mujoco><worldbody><body><freejoint/>{geoms}</body></worldbody></mujoco>"
    model = SolidModel.from_string(xml, density=100.0)
    assert model.body_mass[1] == pytest.approx(mass, rel=1e-6)


def test_groups_without_inertia_stay_without() -> None:
    geoms = "<geom size='.5' group='1'/><geom size='.6' group='3'/>"
    text = f"<worldbody><body><freejoint/>{geoms}</body></worldbody>"
    xml = f"<mujoco><compiler inertiagrouprange='0 2'/>{text}</mujoco>"
    assert SolidModel.from_string(xml).body_mass[1] == pytest.approx(523.6, rel=1e-3)
