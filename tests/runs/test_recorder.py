import json

import mujoco
import numpy as np
import pytest

from flowborne.coupling.world import Fluid, Setup, World
from flowborne.fluid.grid import Grid
from flowborne.fluid.state import FluidState
from flowborne.runs.recorder import Recorder, centres, open_cells, write_model
from flowborne.runs.run_folder import RunFolder, RunFolderError
from flowborne.runs.states import read_state
from flowborne.solids.dynamics import kinematics
from flowborne.solids.model import SolidModel
from flowborne.solids.tissue.growth import Tissue, add_flesh
from flowborne_validation.flesh_bars import bar_mesh

DISC = """
<mujoco>
  <worldbody>
    <body name="disc" pos="0.13 -0.07 0">
      <joint name="hinge" axis="0 0 1"/>
      <geom name="disc" type="cylinder" size="0.5 1"/>
    </body>
  </worldbody>
</mujoco>
"""

BALL = """
<mujoco>
  <worldbody>
    <body name="ball" pos="0.13 -0.07 0.02">
      <freejoint/><geom name="ball" type="sphere" size="0.5"/>
    </body>
  </worldbody>
</mujoco>
"""

TETRAHEDRON = """
<mujoco>
  <asset><mesh name="fin" vertex="0 0 0  1 0 0  0 1 0  0 0 1"/></asset>
  <worldbody>
    <body name="fin"><freejoint name="root"/><geom name="fin" type="mesh" mesh="fin"/></body>
  </worldbody>
</mujoco>
"""

BONE = """
<mujoco>
  <worldbody>
    <body name="bone" pos="0.2 0 0">
      <joint name="hinge" axis="0 1 0"/>
      <geom name="bone" type="capsule" fromto="0.05 0 0 0.35 0 0" size="0.05"/>
    </body>
    <body name="ball" pos="0 -1 0">
      <freejoint name="free"/><geom name="ball" type="sphere" size="0.1"/>
    </body>
  </worldbody>
</mujoco>
"""


def disc_world(cells):
    model = SolidModel.from_string(DISC, slab=True)
    grid = Grid.slab(cells, cells, 2.0 / cells, (-1.0, -1.0))
    state = FluidState.at_rest(grid, ("smoke",))
    return World(Setup(model, Fluid(grid, 1.0, scalars=("smoke",))), model.rest(), state)


@pytest.mark.parametrize(("cells", "error"), [(32, 4e-3), (64, 1e-3)])
def test_open_cells_leave_out_the_area_of_a_disc(cells, error):
    world = disc_world(cells)
    part = open_cells(world)
    assert part.shape == (cells, cells, 1)
    assert part.min() == 0.0
    closed = (1.0 - part).sum() * world.setup.fluid.grid.cell_volume
    assert closed == pytest.approx(np.pi * 0.25, rel=error)


def test_a_state_holds_what_a_picture_needs_in_single_precision(tmp_path):
    world = disc_world(16)
    world.fluid.pressure[:] = np.arange(256.0).reshape(16, 16, 1) / 3
    recorder = Recorder(RunFolder.create(tmp_path / "run"))
    recorder.write(0, world, None)
    path = recorder.folder.state(0)
    state = np.load(path)
    assert state["velocity_x"].shape == (17, 16, 1)
    assert "velocity_z" not in state
    assert state["pressure"].dtype == np.float32
    np.testing.assert_array_equal(state["pressure"], world.fluid.pressure.astype(np.float32))
    assert state["scalar_smoke"].shape == state["open"].shape == (16, 16, 1)
    np.testing.assert_allclose(state["fluid_centre"][1], [0.13, -0.07, 0.0], atol=1e-7)
    assert path.stat().st_size == pytest.approx(recorder.bytes_per_frame(world), rel=0.1)


def test_a_state_in_space_holds_all_three_axes(tmp_path):
    model = SolidModel.from_string(BALL)
    grid = Grid((20, 18, 16), 0.1, (-1.0, -0.9, -0.8))
    setup = Setup(model, Fluid(grid, 1.0, scalars=("smoke",)))
    world = World(setup, model.rest(), FluidState.at_rest(grid, ("smoke",)))
    recorder = Recorder(RunFolder.create(tmp_path / "run"))
    recorder.write(0, world, None)
    path = recorder.folder.state(0)
    state = np.load(path)
    for axis, name in enumerate("xyz"):
        assert state[f"velocity_{name}"].shape == grid.face_shape(axis)
    closed = (1.0 - state["open"]).sum() * grid.cell_volume
    assert closed == pytest.approx(4.0 / 3.0 * np.pi * 0.5**3, rel=0.025)
    assert path.stat().st_size == pytest.approx(recorder.bytes_per_frame(world), rel=0.05)


def test_model_json_describes_a_mesh_and_the_grid(tmp_path):
    model = SolidModel.from_string(TETRAHEDRON)
    setup = Setup(model, Fluid(Grid((8, 8, 8), 0.5), 1000.0))
    folder = RunFolder.create(tmp_path / "run")
    write_model(folder, setup, controlled=[], frames_per_second=60.0, wind=[])
    written = json.loads(folder.model.read_text())
    assert (written["slab"], written["bodies"]) == (False, ["world", "fin"])
    assert written["grid"] == {"shape": [8, 8, 8], "spacing": 0.5, "origin": [0.0, 0.0, 0.0]}
    (geom,) = written["geoms"]
    assert (geom["type"], geom["body"]) == ("mesh", 1)
    corners = np.array(geom["vertices"])[np.array(geom["faces"])]
    volume = np.linalg.det(corners).sum() / 6
    assert volume == pytest.approx(1 / 6, rel=1e-5)


def limb():
    """A cube of flesh around a bone, and a cube that nothing carries."""
    spec = mujoco.MjSpec.from_string(BONE)
    points, elements = bar_mesh((4, 2, 2), (0.8, 0.4, 0.4))
    tissue = Tissue(young=1e4, poisson=0.3, density=1000.0)
    inside = np.abs(points - [0.4, 0.0, 0.0]).max(axis=1) < 0.21
    held = inside & (np.abs(points[:, 1:]).max(axis=1) < 0.1)
    first = add_flesh(spec, "limb", points, elements, tissue, ["bone" if h else "" for h in held])
    apart = points + np.array([0.0, 2.0, 0.0])
    second = add_flesh(spec, "lump", apart, elements, tissue, [""] * len(points))
    return SolidModel.with_flesh(spec, [first, second])


def test_a_state_holds_the_skin_where_it_is(tmp_path):
    model = limb()
    world = World(Setup(model), model.rest())
    rng = np.random.default_rng(0)
    world.solid.q += 0.02 * rng.standard_normal(model.nq)
    recorder = Recorder(RunFolder.create(tmp_path / "run"))
    recorder.write(0, world, None)
    write_model(recorder.folder, world.setup, controlled=[], frames_per_second=60.0, wind=[])
    state = np.load(recorder.folder.state(0))
    written = json.loads(recorder.folder.model.read_text())
    skin = state["flesh_vertices"]
    inner = 7 * 3 * 3  # of the 9 x 5 x 5 nodes of each
    assert skin.shape == (2 * (225 - inner), 3)
    assert skin.dtype == np.float32
    vertices = kinematics(model, world.solid.q).vertices
    triangles = np.array(written["flesh"]["triangles"])
    np.testing.assert_allclose(skin[triangles], vertices[model.flesh.surface], atol=1e-6)
    size = recorder.folder.state(0).stat().st_size
    assert size == pytest.approx(recorder.bytes_per_frame(world), rel=0.1)


def test_model_json_says_whose_flesh_is_where(tmp_path):
    model = limb()
    folder = RunFolder.create(tmp_path / "run")
    write_model(folder, Setup(model), controlled=["hinge"], frames_per_second=60.0, wind=[])
    written = json.loads(folder.model.read_text())
    assert written["flesh"]["names"] == ["limb", "lump"]
    of_triangles = np.array(written["flesh"]["of_triangles"])
    triangles = np.array(written["flesh"]["triangles"])
    assert len(of_triangles) == len(triangles)
    assert not np.intersect1d(triangles[of_triangles == 0], triangles[of_triangles == 1]).size
    assert [geom["covered"] for geom in written["geoms"]] == [True, False]
    assert written["flesh"]["bodies"] == [0, 1]
    assert written["flesh"]["body_position"][1] == model.mj.body_pos[1].tolist()
    skin = np.array(written["flesh"]["rest"])[triangles]
    np.testing.assert_array_equal(skin, model.flesh.rest[model.flesh.surface])
    assert (written["joints"], written["joint_bodies"]) == (["hinge", "free"], [1, 2])


def test_the_force_on_flesh_is_drawn_from_its_middle():
    model = limb()
    pose = kinematics(model, model.rest().q)
    middle = centres(model, pose)
    np.testing.assert_allclose(middle[0], [0.4, 2.0, 0.0], atol=1e-9)
    np.testing.assert_allclose(middle[1], [0.4, 0.0, 0.0], atol=1e-9)
    np.testing.assert_allclose(middle[2], pose.centroid[2])


def test_a_state_of_times_in_place_of_places_is_refused(tmp_path):
    path = tmp_path / "000001.npz"
    np.savez(path, time=np.array(0.0), geom_position=np.zeros((1, 3), "datetime64[s]"))
    with pytest.raises(RunFolderError, match="its 'geom_position' holds no numbers"):
        read_state(path)


def test_a_state_whose_arrays_do_not_fit_each_other_is_refused(tmp_path):
    path = tmp_path / "000001.npz"
    sound = {
        "time": np.array(0.0),
        "geom_position": np.zeros((2, 3)),
        "geom_rotation": np.zeros((2, 3, 3)),
        "fluid_centre": np.zeros((4, 3)),
        "fluid_force": np.zeros((4, 3)),
    }
    np.savez(path, **sound)
    read_state(path)
    for wrong in (np.zeros(4), np.zeros((4, 2)), np.zeros((3, 3))):
        np.savez(path, **sound | {"fluid_centre": wrong})
        with pytest.raises(
            RunFolderError, match=r"its 'fluid_\w+' has the shape .*not \(body, axis\)"
        ):
            read_state(path)
