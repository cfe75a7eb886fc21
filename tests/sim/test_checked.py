"""What `check` says of a scene, in Python as on the command line."""

from __future__ import annotations

from pathlib import Path

import pytest

import flowborne as fb
from flowborne.scenes.warn import KINDS
from flowborne.sim.checked import check

COARSE = {"domain.resolution": "24"}


@pytest.mark.parametrize(
    ("settings", "said"),
    [
        ({}, "viscosity none: no friction, walls slip; water has 1e-3 Pa s"),
        ({"fluid.viscosity": "2.0"}, "viscosity 2 Pa s, Re 429 (1 m/s past 0.858 m)"),
        ({"fluid.density": "1.2"}, "walls slip; air has 1.8e-5 Pa s"),
    ],
)
def test_one_line_is_about_the_fluid(settings: dict[str, str], said: str) -> None:
    """A block of 0.858 m in a stream of 1 m/s."""
    fluid = check(fb.load_scene("ns-block-drag-max", COARSE | settings)).fluid
    density = settings.get("fluid.density", "1000")
    assert fluid.startswith(f"fluid: {density} kg/m^3, ")
    assert fluid.endswith(said)


def test_there_is_no_reynolds_number_at_rest_and_no_fluid_in_air() -> None:
    assert check("block-drag-max").fluid == "fluid: none"
    found = check(fb.load_scene("eel", {"domain.resolution": "40"}))
    assert found.fluid == "fluid: 1000 kg/m^3, viscosity 0.001 Pa s"


def test_what_is_found_is_a_line_in_repr_and_all_in_str() -> None:
    found = check("human-wind-drag")
    assert repr(found) == "Checked 'human-wind-drag': no warnings, 2 notes"
    assert found.warnings == ()
    assert len(found.notes) == 2
    assert all(f"  note: {note}\n" in f"{found}\n" for note in found.notes)
    assert "<pre>creature: 73 kg" in found._repr_html_()


def test_every_kind_of_warning_has_its_name_on_the_page() -> None:
    page = (Path(__file__).parents[2] / "docs" / "commands.md").read_text(encoding="utf-8")
    assert [kind for kind in KINDS if f"`{kind}`" not in page] == []
