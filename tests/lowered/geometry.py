"""`jaxsh.geometry` at full size."""

from jaxsh import geometry

from .shared import V, floats, integers, of, shapes

HOST, SCENE = "runs on the host", "a scene casts on the host's arrays; `trace` is what it runs"
WITHOUT = {
    "EmbreeRayScene": HOST,
    "JaxRayScene": HOST,
    "JaxRayScene.closest_hit": SCENE,
    "JaxRayScene.occluded": SCENE,
    "from_trimesh": HOST,
    "make_mesh": HOST,
    "ray_scene": HOST,
    "write_mesh": HOST,
}


def calls():
    g = geometry
    tree = shapes(g.JaxRayScene(g.knot(300)).tree)
    rays = floats(V, 3)
    return {
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
