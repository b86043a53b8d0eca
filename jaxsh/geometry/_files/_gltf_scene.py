"""Place the meshes of a glTF file: nodes, instances and skins, as matrices."""

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np
from jaxtyping import Float

from ..._core.gltf import Document
from ..._core.json_fields import (
    Fields,
    extension,
    flag,
    indices,
    inner,
    listed,
    numbers,
    shown,
    whole,
)
from ._gltf_accessors import read_accessor

# The pose of a node, by default none.
_REST = {
    "translation": [0.0, 0.0, 0.0],
    "rotation": [0.0, 0.0, 0.0, 1.0],
    "scale": [1.0, 1.0, 1.0],
}


class Placement(NamedTuple):
    """Holds a mesh with where its copies stand, or with the matrices of its joints."""

    mesh: int
    weights: list[float] | None  # of morph targets, None for the mesh's own
    matrices: Float[np.ndarray, "k 4 4"]
    joints: Float[np.ndarray, "j 4 4"] | None
    owner: str


def placements(document: Document) -> Iterator[Placement]:
    """List what the scene shows, in the order of the nodes of its tree.

    Nodes of no scene are noted; where there are no nodes at all, each mesh stands once as it is.
    Raises `ValueError` where a node has two parents or is its own ancestor.
    """
    count = len(listed(document.fields, "nodes", "the file"))
    if count == 0:
        for mesh in range(len(listed(document.fields, "meshes", "the file"))):
            yield Placement(mesh, None, np.eye(4)[None], None, "the file")
        return
    nodes = [document.item("nodes", index, "the file") for index in range(count)]
    children = [indices(node, "children", f"node {i}") for i, node in enumerate(nodes)]
    world = _world_matrices(document, nodes, children)
    reached = np.zeros(count, bool)
    # Copies of one mesh that differ by their matrix only are placed together.
    together: dict[int, list[Placement]] = {}
    for index in _shown_nodes(document, nodes, children, reached):
        node = nodes[index]
        if node.get("mesh") is None:
            continue
        placement = _placement(document, node, world, index)
        plain = placement.weights is None and placement.joints is None
        if plain:
            together.setdefault(placement.mesh, []).append(placement)
        else:
            yield placement
    for same in together.values():
        yield same[0]._replace(matrices=np.concatenate([one.matrices for one in same]))
    hidden = sum(node.get("mesh") is not None for i, node in enumerate(nodes) if not reached[i])
    document.note("nodes with meshes outside the scene ignored", hidden)


def _world_matrices(
    document: Document, nodes: list[Fields], children: list[list[int]]
) -> Float[np.ndarray, "n 4 4"]:
    """Multiply the matrices of all ancestors, from the roots down."""
    parents = [-1] * len(nodes)
    for index, own in enumerate(children):
        for child in own:
            if child >= len(nodes):
                raise ValueError(
                    f"node {index} names node {shown(child)}, but there are {len(nodes)}"
                )
            if parents[child] >= 0:
                raise ValueError(f"node {child} is a child of both {parents[child]} and {index}")
            parents[child] = index
    world = _local_matrices(document, nodes)
    waiting = [index for index, parent in enumerate(parents) if parent < 0]
    done = 0
    while waiting:
        index = waiting.pop()
        done += 1
        if parents[index] >= 0:
            world[index] = world[parents[index]] @ world[index]
        waiting.extend(children[index])
    if done < len(nodes):
        raise ValueError("its nodes are nested in a circle")
    return world


def _shown_nodes(
    document: Document, nodes: list[Fields], children: list[list[int]], reached: np.ndarray
) -> Iterator[int]:
    """List the nodes of the scene, parents first, and mark them."""
    nested = np.zeros(len(nodes), bool)
    nested[[child for own in children for child in own]] = True
    scenes = listed(document.fields, "scenes", "the file")
    if scenes:
        # Where none is named the first is what most programs show.
        number = whole(document.fields, "scene", "the file", 0)
        if document.fields.get("scene") is None:
            document.note("further scenes ignored, since none is named", len(scenes) - 1)
        title = f"scene {number}"
        roots = indices(document.item("scenes", number, "the file"), "nodes", title)
        for root in roots:
            if root >= len(nodes):
                raise ValueError(f"{title} names node {shown(root)}, but there are {len(nodes)}")
            if nested[root]:
                raise ValueError(f"{title} names node {root}, which is a child of another")
    else:
        roots = np.flatnonzero(~nested).tolist()
    waiting = list(dict.fromkeys(roots))[::-1]
    while waiting:
        index = waiting.pop()
        reached[index] = True
        visibility = extension(nodes[index], "KHR_node_visibility", f"node {index}")
        if visibility is not None and not flag(visibility, "visible", f"node {index}", True):
            document.note("invisible nodes ignored, with what is below them")
            _mark_below(index, children, reached)
            continue
        yield index
        waiting.extend(reversed(children[index]))


def _mark_below(index: int, children: list[list[int]], reached: np.ndarray) -> None:
    waiting = [index]
    while waiting:
        index = waiting.pop()
        reached[index] = True
        waiting.extend(children[index])


def _placement(
    document: Document, node: Fields, world: Float[np.ndarray, "n 4 4"], index: int
) -> Placement:
    owner = f"node {index}"
    weights = None
    if node.get("weights") is not None:
        weights = numbers(node, "weights", owner, None, None)
    copies = extension(node, "EXT_mesh_gpu_instancing", owner)
    matrices = world[index : index + 1]
    joints = None
    if node.get("skin") is not None:
        if copies is not None:
            raise ValueError(f"{owner} has both a skin and EXT_mesh_gpu_instancing")
        joints = _joint_matrices(document, whole(node, "skin", owner), world, owner)
    if copies is not None:
        matrices = world[index] @ _instances(document, copies, owner)
    return Placement(whole(node, "mesh", owner), weights, matrices, joints, owner)


def _local_matrices(document: Document, nodes: list[Fields]) -> Float[np.ndarray, "n 4 4"]:
    given = [i for i, node in enumerate(nodes) if node.get("matrix") is not None]
    parts = {key: np.tile(default, (len(nodes), 1)) for key, default in _REST.items()}
    for i, node in enumerate(nodes):
        for key, values in parts.items():
            if node.get(key) is not None:
                values[i] = numbers(node, key, f"node {i}", values.shape[1], None)
    both = sum(any(nodes[i].get(key) is not None for key in _REST) for i in given)
    document.note("nodes have both a matrix and its parts: the matrix is taken", both)
    parts["rotation"][given] = _REST["rotation"]
    local = _trs(**parts, owner="node")
    for i in given:
        local[i] = np.array(numbers(nodes[i], "matrix", f"node {i}", 16, None)).reshape(4, 4).T
        if not np.allclose(local[i, 3], [0, 0, 0, 1], atol=1e-5):
            raise ValueError(f"node {i} has a matrix whose last row is not 0, 0, 0, 1")
    return local


def _trs(
    translation: Float[np.ndarray, "k 3"],
    rotation: Float[np.ndarray, "k 4"],
    scale: Float[np.ndarray, "k 3"],
    owner: str,
) -> Float[np.ndarray, "k 4 4"]:
    """Make translation · rotation · scale; `rotation` are quaternions x, y, z, w of any length."""
    length = np.linalg.norm(rotation, axis=1)
    if not (length > 0).all():
        index = int((~(length > 0)).argmax())
        raise ValueError(f"{owner} {index} has a rotation of length {length[index]}, expected 1")
    x, y, z, w = (rotation / length[:, None]).T
    turned = [
        [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
        [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
        [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
    ]
    matrices = np.zeros((len(scale), 4, 4))
    matrices[:, :3, :3] = np.moveaxis(np.array(turned), 2, 0) * scale[:, None, :]
    matrices[:, :3, 3] = translation
    matrices[:, 3, 3] = 1
    return matrices


def _instances(document: Document, fields: Fields, owner: str) -> Float[np.ndarray, "k 4 4"]:
    """Read the copies that EXT_mesh_gpu_instancing makes of the mesh of a node."""
    attributes = inner(fields, "attributes", f"EXT_mesh_gpu_instancing of {owner}")
    read = {}
    for name, kind in {"TRANSLATION": "VEC3", "ROTATION": "VEC4", "SCALE": "VEC3"}.items():
        if name in attributes:
            title = f"{name} of EXT_mesh_gpu_instancing of {owner}"
            number = whole(attributes, name, title)
            found = read_accessor(document, number, title, (kind,))
            document.spend(16 * len(found.raw))  # a matrix for each, and its making
            # Integers may only stand for fractions here, as quaternions.
            read[name] = found._replace(normalized=name == "ROTATION").all()
    counts = {len(rows) for rows in read.values()}
    if len(counts) != 1:
        raise ValueError(
            f"EXT_mesh_gpu_instancing of {owner} should have attributes of one length, "
            f"got {sorted(counts)}"
        )
    k = counts.pop()
    return _trs(
        read.get("TRANSLATION", np.zeros((k, 3))),
        read.get("ROTATION", np.tile([0.0, 0.0, 0.0, 1.0], (k, 1))),
        read.get("SCALE", np.ones((k, 3))),
        f"{owner}: instance",
    )


def _joint_matrices(
    document: Document, index: int, world: Float[np.ndarray, "n 4 4"], owner: str
) -> Float[np.ndarray, "j 4 4"]:
    """Give what each joint of a skin does to a vertex: its place times the inverse of its rest."""
    fields, name = document.item("skins", index, owner), f"skin {index}"
    joints = indices(fields, "joints", name)
    if not joints:
        raise ValueError(f"{name} has no joints")
    if max(joints) >= len(world):
        raise ValueError(f"{name} names node {shown(max(joints))}, but there are {len(world)}")
    document.spend(64 * len(joints))  # many nodes may have one skin
    if fields.get("inverseBindMatrices") is None:
        return world[joints]
    title = f"inverseBindMatrices of {name}"
    found = read_accessor(document, whole(fields, "inverseBindMatrices", name), title, ("MAT4",))
    if len(found.raw) < len(joints):
        raise ValueError(f"{title} has {len(found.raw)} elements for {len(joints)} joints")
    rest = found.rows(np.arange(len(joints))).reshape(-1, 4, 4).transpose(0, 2, 1)
    return world[joints] @ rest
