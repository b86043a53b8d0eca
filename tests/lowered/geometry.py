"""`jaxsh.geometry` at full size."""

from jaxsh import geometry

from .shared import V, floats, integers, made_by, of, shapes

HOST, SCENE = "runs on the host", "a scene casts on the host's arrays; `trace` is what it runs"
WITHOUT = {
    "EmbreeRayScene": HOST,
    "JaxRayScene": HOST,
    "JaxRayScene.closest_hit": SCENE,
    "JaxRayScene.occluded": SCENE,
    "from_trimesh": HOST,
    "make_mesh": HOST,
    "Points": "holds what it is given",
    "ray_scene": HOST,
    "write_mesh": HOST,
}


def atlas() -> geometry.Texels:
    """The shapes of V texels of a picture, on a mesh of half as many vertices."""
    mesh = made_by(geometry.Mesh, floats(V // 2, 3), integers(V, 3), floats(V // 2, 3))
    rows = floats(V, 3), floats(V, 3), floats(V, 2), integers(V), floats(V, 3)
    return made_by(geometry.Texels, *rows, integers(512, 512), mesh, integers(V // 2))


def calls():
    g = geometry
    tree = shapes(g.JaxRayScene(g.knot(300)).tree)
    rays = floats(V, 3)
    held = atlas()
    return {
        "Texels.carry": of(lambda held, values: held.carry(values), held, floats(V // 2, 16)),
        "Texels.image": of(lambda held, values: held.image(values, 0.5), held, rays),
        "trace": of(
            lambda tree, origins, directions: g.trace(tree, origins, directions, 3.0, lanes=2**15),
            tree,
            rays,
            rays,
            trips=4,
            open=2,
            why="a ray ends after as many nodes of the tree as it meets, four in a burst",
            reverse=False,
        ),
        "vertex_normals": of(g.vertex_normals, floats(V, 3), integers(2 * V, 3)),
    }
