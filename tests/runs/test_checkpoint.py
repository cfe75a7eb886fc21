import numpy as np
import pytest

from flowborne.base import given
from flowborne.base.given import read_arrays
from flowborne.coupling.world import Fluid, Setup, World
from flowborne.fluid.grid import Grid
from flowborne.fluid.state import FluidState
from flowborne.runs.checkpoint import load_checkpoint, save_checkpoint, state_bytes
from flowborne.solids.model import SolidModel

MODEL = """
<mujoco>
  <worldbody>
    <body name="block">
      <joint name="hinge" axis="0 0 1"/>
      <geom name="block" type="box" size="1 0.2 1"/>
    </body>
  </worldbody>
</mujoco>
"""


@pytest.fixture
def world():
    grid = Grid.slab(6, 4, 0.5, (0.0, 0.0))
    state = FluidState.at_rest(grid, ("smoke",))
    numbers = np.random.default_rng(1)
    for values in state.arrays().values():
        values[...] = numbers.normal(size=values.shape)
    memory = {"target": np.array([0.1, np.nextafter(0.2, 1.0)])}
    model = SolidModel.from_string(MODEL, slab=True)
    setup = Setup(model, Fluid(grid, 1.0, scalars=("smoke",)))
    return World(setup, model.rest(), state, time=1 / 3, steps=7, ahead=0.05, memory=memory)


def test_a_world_is_read_back_bit_for_bit(tmp_path, world):
    path = tmp_path / "checkpoint.npz"
    save_checkpoint(path, world, 5)
    again, frame, _ = load_checkpoint(path, world.setup)
    assert (frame, again.steps, again.time, again.ahead) == (5, 7, world.time, 0.05)
    saved, read = world.arrays(), again.arrays()
    assert list(saved) == list(read)
    for name, values in saved.items():
        assert np.array_equal(values, read[name])
        assert not np.shares_memory(values, read[name])


@pytest.mark.parametrize(
    ("name", "change", "said"),
    [
        ("solid/q", lambda q: np.zeros(3), r"'solid/q' is \[3\] of float64 in place of \[1\]"),
        ("solid/v", lambda v: v.astype(complex), r"'solid/v' is \[1\] of complex128 in place"),
        ("fluid/pressure", lambda p: p.astype(str), "'fluid/pressure' is"),
        (
            "fluid/previous_pressure",
            lambda p: p * np.nan,
            "'fluid/previous_pressure' has a number that is not finite",
        ),
        ("fluid/scalar_smoke", lambda p: p[None], "'fluid/scalar_smoke' is"),
        ("memory/target", lambda q: q[:1], r"'memory/target' is \[1\] of float64 in place of"),
        ("clock", lambda clock: clock[:2], "'clock' is"),
        ("frame", lambda frame: frame - 9, "'frame' is no number of frames"),
        ("frame", lambda frame: frame * np.inf, "'frame' is no number of frames"),
    ],
)
def test_arrays_of_another_shape_or_type_are_refused(tmp_path, world, name, change, said):
    path = tmp_path / "checkpoint.npz"
    save_checkpoint(path, world, 5)
    with np.load(path) as saved:
        arrays = dict(saved)
    np.savez(path, **arrays | {name: change(arrays[name])})
    with pytest.raises(ValueError, match=said):
        load_checkpoint(path, world.setup, {"target": (2,)})


def test_arrays_that_unpack_to_gigabytes_are_refused(tmp_path, monkeypatch):
    monkeypatch.setattr(given, "MOST_UNPACKED", 1 << 20)
    path = tmp_path / "bomb.npz"
    np.savez(path, q=np.zeros(1 << 18))
    read_arrays(path)  # as large as its file
    np.savez_compressed(path, q=np.zeros(1 << 18))
    with pytest.raises(ValueError, match=r"unpacks to 0.00195 GB, and 0.000977 GB are the most"):
        read_arrays(path)


def test_equal_worlds_give_equal_files(tmp_path, world):
    save_checkpoint(tmp_path / "a.npz", world, 5)
    save_checkpoint(tmp_path / "b.npz", world.copy(), 5)
    assert (tmp_path / "a.npz").read_bytes() == (tmp_path / "b.npz").read_bytes()


@pytest.mark.parametrize("contents", [b"", b"PK\x03\x04 torn"])
def test_what_is_no_checkpoint_is_refused(tmp_path, world, contents):
    path = tmp_path / "checkpoint.npz"
    path.write_bytes(contents)
    with pytest.raises(ValueError, match="is not a checkpoint of this scene"):
        load_checkpoint(path, world.setup)


def test_state_bytes_counts_every_array_once(world):
    cells = 6 * 4
    faces = 7 * 4 + 6 * 5 + 2 * cells
    clock, bodies, target, corner = 4, 2, 2, 3
    assert state_bytes(world) == 8 * (3 * cells + 3 * faces + clock + bodies + target + corner)
