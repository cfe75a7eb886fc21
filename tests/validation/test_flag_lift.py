"""D6: where the flag's end is, and how the worst lift is found."""

from __future__ import annotations

import pytest

from flowborne_validation import flag_lift
from flowborne_validation.cases import case
from flowborne_validation.flag_in_channel import END, HEIGHT, channel


@pytest.mark.parametrize("behind", flag_lift.PLACES)
@pytest.mark.parametrize("end", flag_lift.FLAGS)
def test_D6_the_flag_ends_behind_a_plane_of_nodes(end: str, behind: float) -> None:
    world = channel(41, flag_lift.FLOW, behind, flag_lift.bodies(end, 0.203))
    grid = world.flow()[0].grid
    assert (END[0] - grid.origin[0]) / grid.spacing % 1.0 == pytest.approx(behind)
    assert grid.shape[1] * grid.spacing == pytest.approx(HEIGHT)
    mj = world.setup.solid.mj
    size = mj.geom_size[1][0] if end == "square" else mj.geom_size[1].sum()
    assert mj.geom_pos[1] + (size, 0.0, 0.0) == pytest.approx((END[0], 0.203, 0.0))


def test_D6_judges_the_worst_place_of_a_straight_line(monkeypatch: pytest.MonkeyPatch) -> None:
    def lifts(end: str, y: float, grids: list[int]) -> dict[int, list[float]]:
        right = 1.119 * (0.205 - y) / 0.005
        return {cells: [right, right + 0.05, right - 0.02, right, right, right] for cells in grids}

    monkeypatch.setattr(flag_lift, "lifts", lifts)
    found = case("D6").run()
    assert [r.value - r.reference for r in found] == pytest.approx([0.05] * 8)
    assert [r.verdict for r in found] == ["pass", "fail"] * 4
    assert [r.reference for r in found[::2]] == pytest.approx([1.119, 0.8952, 0.4476, 0.4476])
    assert [r.tolerance for r in found[:2]] == ["5 % of 1.119", "3 % of 1.119"]
