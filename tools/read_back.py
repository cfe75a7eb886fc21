"""Files of a run as the libraries of other programs read them.

Each reader gives `times` (frames,) in s, and what its format holds of: `joints(frame)`, a dict of
name -> (4, 4) frame of the joint, and `meshes(frame)`, a dict of name -> (k, 3) vertices; both in
m and in the world's axes, z up.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pygltflib
import tinyvdb
import vtkmodules.vtkCommonDataModel
from alembic3d import Abc, AbcGeom
from numpy.typing import NDArray
from pxr import Gf, Usd, UsdGeom, UsdSkel
from scipy.spatial.transform import Rotation
from vtkmodules.util.numpy_support import vtk_to_numpy
from vtkmodules.vtkCommonExecutionModel import vtkStreamingDemandDrivenPipeline
from vtkmodules.vtkIOHDF import vtkHDFReader

from flowborne.formats.creature import Creature
from flowborne.motion.bvh import TO_WORLD
from flowborne.motion.bvh_file import load_bvh

Array = NDArray[Any]

UP = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, 1.0], [0.0, -1.0, 0.0]])
"""From the run's axes, z up, to y up, as rows: points @ UP leads back."""


def meshes_of(creature: Creature, frame: int) -> dict[str, Array]:
    """Name -> (k, 3) m of every geometry and flesh of the run."""
    state, model = creature.run.state(frame), creature.model
    found = {
        name: model.geom_shape[n].triangles()[0] @ state["geom_rotation"][n].T
        + state["geom_position"][n]
        for n, name in enumerate(model.geom_names)
    }
    return found | {s.name: state["flesh_vertices"][s.chosen] for s in creature.skins}


class Gltf:
    """Binary glTF by pygltflib, skinned and morphed as the specification says."""

    def __init__(self, path: Path) -> None:
        self.gltf = pygltflib.GLTF2().load(str(path))
        self.blob = self.gltf.binary_blob()
        (self.animation,) = self.gltf.animations
        self.times = self.array(self.animation.samplers[0].input).ravel()

    def array(self, number: int) -> Array:
        """(count, width) of an accessor."""
        kinds = {5126: np.float32, 5125: np.uint32, 5123: np.uint16}
        accessor = self.gltf.accessors[number]
        width = {"SCALAR": 1, "VEC3": 3, "VEC4": 4, "MAT4": 16}[accessor.type]
        view = self.gltf.bufferViews[accessor.bufferView]
        kind = kinds[accessor.componentType]
        found = np.frombuffer(self.blob, kind, accessor.count * width, view.byteOffset)
        return found.reshape(-1, width)

    def animated(self, frame: int) -> dict[tuple[int, str], Array]:
        """(node, property) -> its value."""
        found = {}
        for channel in self.animation.channels:
            values = self.array(self.animation.samplers[channel.sampler].output)
            if channel.target.path == "weights":
                values = values.reshape(len(self.times), -1)
            found[channel.target.node, channel.target.path] = values[frame]
        return found

    def nodes(self, frame: int) -> dict[int, Array]:
        """Node -> (4, 4) its frame to the file's scene."""
        moved, found = self.animated(frame), {}

        def visit(number: int, above: Array) -> None:
            node = self.gltf.nodes[number]
            own = np.eye(4)
            turn = moved.get((number, "rotation"), node.rotation)
            shift = moved.get((number, "translation"), node.translation)
            if turn is not None:
                own[:3, :3] = Rotation.from_quat(turn).as_matrix()
            if shift is not None:
                own[:3, 3] = shift
            found[number] = above @ own
            for child in node.children or []:
                visit(child, found[number])

        for root in self.gltf.scenes[0].nodes:
            visit(root, np.eye(4))
        return found

    def joints(self, frame: int) -> dict[str, Array]:
        nodes, upright = self.nodes(frame), np.eye(4)
        upright[:3, :3] = UP.T
        return {self.gltf.nodes[j].name: upright @ nodes[j] for j in self.gltf.skins[0].joints}

    def meshes(self, frame: int) -> dict[str, Array]:
        """raises  ValueError where a morph's weight is none that Blender takes"""
        nodes, moved = self.nodes(frame), self.animated(frame)
        return {
            node.name: self._vertices(number, nodes, moved.get((number, "weights"), ())) @ UP
            for number, node in enumerate(self.gltf.nodes)
            if node.mesh is not None
        }

    def _vertices(self, number: int, nodes: dict[int, Array], weights: Any) -> Array:
        """(k, 3) the mesh of a node in the file's scene, morphed and skinned."""
        node = self.gltf.nodes[number]
        part = self.gltf.meshes[node.mesh].primitives[0]
        points = self.array(part.attributes.POSITION).astype(float)
        if not all(0.0 <= weight <= 1.0 for weight in weights):
            raise ValueError(f"{node.name}: weights {weights} are not from 0 to 1")
        for weight, target in zip(weights, part.targets or [], strict=True):
            shape = target["POSITION"] if isinstance(target, dict) else target.POSITION
            points += weight * self.array(shape)
        points = np.c_[points, np.ones(len(points))]
        if node.skin is None:
            return np.asarray((points @ nodes[number].T)[:, :3])
        skin = self.gltf.skins[node.skin]
        inverse = self.array(skin.inverseBindMatrices).reshape(-1, 4, 4).swapaxes(1, 2)
        carried = np.array([nodes[j] for j in skin.joints]) @ inverse
        joints = self.array(part.attributes.JOINTS_0)
        shares = self.array(part.attributes.WEIGHTS_0)
        return np.asarray(np.einsum("km,kmij,kj->ki", shares, carried[joints], points)[:, :3])


class Stage:
    """USD by usd-core, skinned by UsdSkel."""

    def __init__(self, source: Path | Usd.Stage) -> None:
        self.stage = source if isinstance(source, Usd.Stage) else Usd.Stage.Open(str(source))
        frames = np.arange(self.stage.GetStartTimeCode(), self.stage.GetEndTimeCode() + 1.0)
        self.times = frames / self.stage.GetTimeCodesPerSecond()
        root = UsdSkel.Root.Get(self.stage, "/Run/Creature")
        self.skeleton = UsdSkel.Skeleton.Get(self.stage, "/Run/Creature/Skeleton")
        cache = UsdSkel.Cache()
        cache.Populate(root, Usd.PrimDefaultPredicate)
        self.query = cache.GetSkelQuery(self.skeleton)
        (binding,) = cache.ComputeSkelBindings(root, Usd.PrimDefaultPredicate)
        self.bound = {target.GetPrim(): target for target in binding.GetSkinningTargets()}

    def joints(self, frame: int) -> dict[str, Array]:
        transforms = np.array(self.query.ComputeJointSkelTransforms(frame)).swapaxes(1, 2)
        return dict(zip(self.skeleton.GetJointNamesAttr().Get(), transforms, strict=True))

    def meshes(self, frame: int) -> dict[str, Array]:
        found = {}
        for prim in self.stage.Traverse():
            mesh = UsdGeom.Mesh(prim)
            if not mesh or mesh.GetPurposeAttr().Get() == "guide":
                continue
            points = mesh.GetPointsAttr().Get(frame)
            if prim in self.bound:
                transforms = self.query.ComputeSkinningTransforms(frame)
                place = self.bound[prim].ComputeSkinnedTransform(transforms, frame)
                points = [place.Transform(Gf.Vec3d(p)) for p in points]
            found[prim.GetDisplayName()] = np.array(points)
        return found


class Alembic:
    """Alembic caches by alembic3d; `faces` are those of the last meshes."""

    def __init__(self, path: Path) -> None:
        self.top = Abc.IArchive(str(path)).getTop()
        names = [self.top.getChild(n).getName() for n in range(self.top.getNumChildren())]
        self._number = {name: number for number, name in enumerate(names)}
        self.times = max((self.times_of(name) for name in names), key=len)
        self.faces: dict[str, Array] = {}

    def times_of(self, name: str) -> Array:
        """(samples,) s of a child of the archive; one that stays has a single sample."""
        moving = self._moving(self._number[name])
        sampling = moving.getTimeSampling()
        return np.array([sampling.getSampleTime(n) for n in range(moving.getNumSamples())])

    def _moving(self, number: int) -> Any:
        """What has the samples of a child of the archive: its transform, or its mesh."""
        child = self.top.getChild(number)
        if AbcGeom.IXform.matches(child.getHeader()):
            return AbcGeom.IXform(self.top, child.getName()).getSchema()
        return AbcGeom.IPolyMesh(self.top, child.getName()).getSchema()

    def meshes(self, frame: int) -> dict[str, Array]:
        """raises  ValueError where a face is no triangle"""
        found = {}
        for number in range(self.top.getNumChildren()):
            child, move = self.top.getChild(number), np.eye(4)
            name, at = child.getName(), Abc.ISampleSelector(float(self.times[frame]))
            mesh = self._moving(number)
            if AbcGeom.IXform.matches(child.getHeader()):
                move = np.array(mesh.getValue(at).getMatrix(), float).reshape(4, 4)
                mesh = AbcGeom.IPolyMesh(child, child.getChild(0).getName()).getSchema()
            sample = mesh.getValue(at)
            if set(np.array(sample.getFaceCounts())) != {3}:
                raise ValueError(f"{name} has faces that are no triangles")
            points = np.array(sample.getPositions(), float)
            found[name] = (points @ move[:3, :3] + move[3, :3]) @ UP
            self.faces[name] = np.array(sample.getFaceIndices()).reshape(-1, 3)
        return found


class Bvh:
    """BVH, by its numbers alone: position channels replace OFFSET, rotations are multiplied in the
    file's order, a unit is a centimetre."""

    def __init__(self, path: Path) -> None:
        self.bvh = load_bvh(path)
        self.times = self.bvh.frame_time * np.arange(len(self.bvh.values))

    def joints(self, frame: int) -> dict[str, Array]:
        values = self.bvh.values[frame]
        placed: list[Array] = []
        for joint in self.bvh.joints:
            own = np.eye(4)
            own[:3, 3] = joint.offset
            for column, (axis, turning) in enumerate(joint.channels, start=joint.first):
                if turning:
                    turn = Rotation.from_euler("xyz"[axis], values[column], degrees=True)
                    own[:3, :3] = own[:3, :3] @ turn.as_matrix()
                else:
                    own[axis, 3] = values[column]
            placed.append(own if joint.parent < 0 else placed[joint.parent] @ own)
        world = np.eye(4)
        world[:3, :3] = TO_WORLD["y"]
        found = {}
        for joint, own in zip(self.bvh.joints, placed, strict=True):
            own = world @ own @ world.T
            own[:3, 3] *= 0.01
            found[joint.name] = own
        return found


class VtkHdf:
    """VTKHDF by VTK's reader."""

    def __init__(self, path: Path) -> None:
        self._reader = vtkHDFReader()
        self._reader.SetFileName(str(path))
        self._reader.UpdateInformation()
        about, steps = self._reader.GetOutputInformation(0), vtkStreamingDemandDrivenPipeline
        count = about.Length(steps.TIME_STEPS())
        self.times = np.array([about.Get(steps.TIME_STEPS(), n) for n in range(count)])

    def blocks(self, frame: int) -> dict[str, Any]:
        """Name -> block: `bodies`, `forces`, `fluid`, `flesh`."""
        self._reader.UpdateTimeStep(float(self.times[frame]))
        whole = self._reader.GetOutputDataObject(0)
        name = vtkmodules.vtkCommonDataModel.vtkCompositeDataSet.NAME()
        return {
            whole.GetMetaData(n).Get(name): whole.GetBlock(n)
            for n in range(whole.GetNumberOfBlocks())
        }


def cells_of(block: Any, name: str) -> Array:
    """An array of a block's cells."""
    return np.asarray(vtk_to_numpy(block.GetCellData().GetArray(name)))


def points_of(block: Any) -> Array:
    """(n, 3) m, the points of a block."""
    return np.asarray(vtk_to_numpy(block.GetPoints().GetData()))


def grids_of(path: Path, active: dict[str, Array]) -> dict[str, Array]:
    """Fields of an OpenVDB file by tinyvdb.

    active  name -> (nx, ny, nz) which voxels the grid is to have
    """
    with tinyvdb.open(str(path)) as file:
        file.read_grids()
        grids = [file.grid(number) for number in range(file.grid_count)]
        return {
            grid.name: voxels_of(grid, active[grid.name], 3 if grid.name == "velocity" else 1)
            for grid in grids
        }


def voxels_of(grid: Any, active: Array, components: int = 1) -> Array:
    """The field of a grid whose leaves are those that hold `active` voxels, in the file's order:
    by node of 4096^3 voxels, by node of 128^3, by leaf of 8^3. (tinyvdb's own lists end after 64
    leaves.)

    raises  ValueError where the grid has other active voxels
    """
    nodes = [grid.tree.node(number) for number in range(grid.tree.num_nodes)]
    leaves = [node for node in nodes if node.type == "leaf"]
    if sum(leaf.active_voxel_count for leaf in leaves) != active.sum():
        raise ValueError(f"{grid.name} has other active voxels")
    corners = {tuple(corner) for corner in (np.argwhere(active) // 8).tolist()}
    order = sorted(corners, key=lambda c: ([n // 512 for n in c], [n // 16 for n in c], c))
    found = np.zeros([8 * -(-n // 8) for n in active.shape] + [components], np.float32)
    for (i, j, k), leaf in zip(order, leaves, strict=True):
        part = np.frombuffer(leaf.data, np.float32).reshape(8, 8, 8, components)
        found[8 * i : 8 * i + 8, 8 * j : 8 * j + 8, 8 * k : 8 * k + 8] = part
    return np.asarray(found[tuple(slice(0, n) for n in active.shape)].squeeze())
