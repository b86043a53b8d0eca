"""Valid calls of `jaxsh.geometry`."""

import dataclasses

import numpy as np

from jaxsh import geometry

from .shared import floats, knot, of


def square_texels() -> geometry.Texels:
    """The unit square on 3 × 2 texels."""
    corners = np.array([[0.0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]])
    square = geometry.make_mesh(corners, np.array([[0, 1, 2], [0, 2, 3]]))
    return geometry.texels(dataclasses.replace(square, uv=square.vertices[:, :2]), (3, 2))


def calls():
    g = geometry
    mesh, file = knot(), {"path": "no such file.ply", "up": "z"}
    rays = {
        "origins": floats(4, 3).astype(np.float32),
        "directions": floats(4, 3).astype(np.float32),
    }
    corners = np.array([[0.0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]])
    scene = g.JaxRayScene(mesh)
    held = square_texels()
    made = {"normals": "smooth", "origin": (0.0, 0.0, 0.0), "two_sided": True}
    return {
        "EmbreeRayScene": of(g.EmbreeRayScene, meshes=[mesh], threads=1, slow=True),
        "Points": of(
            g.Points,
            positions=floats(4, 3),
            normals=np.repeat([[0.0, 0.6, 0.8]], 4, axis=0),
            finite="positions normals",
        ),
        "Texels.carry": of(held.carry, values=floats(4, 2)),
        "Texels.image": of(held.image, values=floats(6, 3), background=0.5),
        "JaxRayScene": of(g.JaxRayScene, meshes=[mesh], slow=True),
        "JaxRayScene.closest_hit": of(scene.closest_hit, **rays, slow=True),
        "JaxRayScene.occluded": of(scene.occluded, **rays, max_distance=3.0, slow=True),
        "from_trimesh": of(
            g.from_trimesh, shape=g.to_trimesh(mesh), **made, free="normals origin", slow=True
        ),
        "to_trimesh": of(g.to_trimesh, mesh=mesh, host=True),
        "knot": of(g.knot, vertices=300, slow=True),
        "make_mesh": of(
            g.make_mesh,
            vertices=corners,
            faces=np.array([[0, 1, 2], [0, 2, 3]]),
            **made,
            free="normals origin",
            slow=True,
        ),
        "neighbors": of(g.neighbors, mesh=mesh, host=True),
        "ray_scene": of(g.ray_scene, meshes=[mesh], threads=1, slow=True),
        "read_mesh": of(
            g.read_mesh, **file, colors="srgb", **made, free="path normals origin", slow=True
        ),
        "read_points": of(
            g.read_points,
            path="no such file.ply",
            up="z",
            origin=(0.0, 0.0, 0.0),
            free="path origin",
            slow=True,
        ),
        "texels": of(g.texels, mesh=held.mesh, resolution=4, gutter=1, unwrap=False, host=True),
        "topology": of(g.topology, mesh=mesh, host=True),
        "trace": of(
            g.trace, tree=scene.tree, **rays, max_distance=3.0, first=True, count=None, lanes=8
        ),
        "vertex_normals": of(g.vertex_normals, vertices=mesh.vertices, faces=mesh.faces),
        "write_mesh": of(g.write_mesh, path="/dev/null/no/knot.ply", mesh=mesh, up="z", slow=True),
    }
