"""Every public function of arrays is tried on a mesh of devices, or has a reason not to be."""

import ast
import importlib
import inspect
from pathlib import Path

import faces
import pytest
import valid_calls

TESTS = Path(__file__).parent
NO_ARRAYS = "takes numbers or names, or reads or writes a file"
HOST = "runs in NumPy on the host, as its docstring says"
ONE = "takes one picture, camera, eye or mesh: nothing in it is shared out"
REASONS = {
    "_check": {"check": HOST},
    "adaptive": dict.fromkeys(["TileAtlas.nearest", "TileAtlas.tiling"], ONE),
    "geometry": {
        "JaxRayScene.occluded": HOST,
        "from_trimesh": HOST,
        "ray_scene": HOST,
        "read_mesh": NO_ARRAYS,
        "read_points": NO_ARRAYS,
        "texels": HOST,
        "to_trimesh": HOST,
        "write_mesh": NO_ARRAYS,
    },
    "harmonics": dict.fromkeys(
        [
            "conventions",
            "degree_of",
            "degrees",
            "gaunt",
            "index",
            "num_coefficients",
            "orders",
            "window",
        ],
        NO_ARRAYS,
    )
    | {"legendre": HOST},
    "imaging": {
        "Camera.facing": HOST,
        "backdrop": ONE,
        "read_environment": NO_ARRAYS,
        "read_light": NO_ARRAYS,
        "read_splats": NO_ARRAYS,
        "studio": NO_ARRAYS,
        "write_image": NO_ARRAYS,
        "write_light": HOST,
        "write_lightmap": HOST,
        "write_movie": NO_ARRAYS,
        "write_relit": HOST,
        "write_splats": HOST,
    },
    "inverse": {"light_variances": NO_ARRAYS},
    "midrange": {"grid_around": ONE, "place_samples": HOST, "update_samples": HOST},
    "plot": dict.fromkeys(
        [
            "ball",
            "balloon",
            "bands",
            "basis",
            "coefficients",
            "dome",
            "error_map",
            "gradients",
            "light",
            "lobes",
            "shaded",
            "transfer_lobes",
            "vertices",
        ],
        HOST,
    ),
    "sky": {
        "c_header": NO_ARRAYS,
        "habel2008_evaluate": HOST,
        "habel2008_fit": NO_ARRAYS,
        "habel2008_monomials": HOST,
        "preetham_constants": NO_ARRAYS,
        "preetham_fit": NO_ARRAYS,
        "sun_direction": HOST,
        "xyz_to_srgb": NO_ARRAYS,
    },
    "sphere": dict.fromkeys(["cube_map", "fibonacci", "gauss_legendre", "lat_long"], NO_ARRAYS)
    | {"split_sun": HOST},
    "transfer": {
        "bake": HOST,
        "bake_on": HOST,
        "load": NO_ARRAYS,
        "open": NO_ARRAYS,
        "save": HOST,
        "sun_visibility": HOST,
    },
    "viewer": {"export_html": HOST, "view": HOST},
}


def names_in(path: Path, module: str) -> set[str]:
    """The names of a module that a file of tests takes from it, and all methods that it calls."""
    nodes = list(ast.walk(ast.parse(path.read_text(encoding="utf-8"))))
    taken = {
        alias.name
        for node in nodes
        if isinstance(node, ast.ImportFrom) and node.module == f"jaxsh.{module}"
        for alias in node.names
    }
    found = set()
    for node in nodes:
        if isinstance(node, ast.Name) and node.id in taken:
            found.add(node.id)
        elif isinstance(node, ast.Attribute):
            of_module = isinstance(node.value, ast.Name) and node.value.id == module
            found.add(node.attr if of_module else f".{node.attr}")
    return found


@pytest.mark.parametrize("module", faces.PACKAGES)
def test_every_public_function_is_tried_on_a_mesh_of_devices(module):
    package = importlib.import_module(f"jaxsh.{module}")
    public = {
        name
        for name in package.__all__
        if callable(getattr(package, name)) and not inspect.isclass(getattr(package, name))
    }
    for name in valid_calls.table(module):
        whole, _, method = name.partition(".")
        if method and not method.startswith("__") and inspect.isclass(getattr(package, whole)):
            public.add(name)
    excused = set(REASONS.get(module, {}))
    files = (TESTS / module).glob("test_shard*.py")
    tried = set().union(*(names_in(file, module) for file in files))
    tried = {name for name in public if name in tried or f".{name.rpartition('.')[2]}" in tried}
    assert public - tried - excused == set()
    assert excused <= public  # no reason outlives its function
