"""A valid call of every public function and constructor, on small arrays: a table to break."""

import functools
from collections.abc import Callable
from typing import Any, NamedTuple

import jax.numpy as jnp
import numpy as np

from jaxsh import (
    adaptive,
    geometry,
    harmonics,
    imaging,
    inverse,
    midrange,
    plot,
    sky,
    sphere,
    transfer,
)

RNG = np.random.default_rng(14)
V, K = 6, 9


class Call(NamedTuple):
    """A function and valid arguments by name, in its order."""

    function: Callable[..., Any]
    arguments: dict[str, Any]
    # Arguments that must be finite, where they are at hand.
    finite: frozenset[str] = frozenset()
    # Runs in NumPy, reads files, or looks at values: cannot be traced.
    host: bool = False
    # Arguments that take much: a path, a name, a string or a number.
    free: frozenset[str] = frozenset()
    # Only what is refused at once is tried.
    slow: bool = False


def floats(*shape: int):
    return RNG.uniform(0.2, 1.0, size=shape)


def of(function, *, finite: str = "", free: str = "path", host=False, slow=False, **arguments):
    """A `Call`; names are in one string, separated by spaces."""
    names = frozenset(finite.split()), frozenset(free.split())
    return Call(function, arguments, names[0], host or slow, names[1], slow)


@functools.cache
def made():
    """A transfer of degree 2."""
    normals = RNG.normal(size=(V, 3))
    return transfer.unshadowed(jnp.asarray(normals), jnp.asarray(normals), 2)


@functools.cache
def knot():
    return geometry.knot(300)


def eye():
    return np.array([0.0, -3.0, 1.0])


def material():
    return transfer.Material(floats(V, 3), 0.5, 8.0)


def of_harmonics():
    h = harmonics
    f, vectors = floats(2, K), floats(5, 3)
    return {
        "clamped_cosine": of(h.clamped_cosine, degree=2),
        "convolve": of(h.convolve, coefficients=f, zonal=floats(3)),
        "damping": of(h.damping, strength=floats(), degree=2),
        "degree_of": of(h.degree_of, count=9),
        "degrees": of(h.degrees, degree=2),
        "dering": of(h.dering, coefficients=f, of="irradiance"),
        "evaluate": of(h.evaluate, vectors=vectors, degree=2, axis=-1),
        "evaluate_with_gradient": of(h.evaluate_with_gradient, vectors=vectors, degree=2, axis=-1),
        "gaunt": of(h.gaunt, degree=1),
        "index": of(h.index, l=2, m=-1),
        "legendre": of(h.legendre, cos_theta=np.zeros(4), degree=2, host=True, finite="cos_theta"),
        "num_coefficients": of(h.num_coefficients, degree=2),
        "orders": of(h.orders, degree=2),
        "phong": of(h.phong, exponent=floats(), degree=2, normalized=True, finite="exponent"),
        "product": of(h.product, f=f, g=f[0], degree=2),
        "product_matrix": of(h.product_matrix, f=f, degree=2),
        "rotate": of(h.rotate, coefficients=f, rotation=np.eye(3), finite="rotation"),
        "rotate_z": of(h.rotate_z, coefficients=f, angle=floats()),
        "rotation_matrix": of(h.rotation_matrix, rotation=np.eye(3), degree=2, finite="rotation"),
        "triple_integral": of(h.triple_integral, f=f, g=f, h=f),
        "window": of(h.window, kind="hann", degree=2),
    }


def of_sphere():
    s = sphere
    quadrature = s.fibonacci(7)
    return {
        "Quadrature": of(
            s.Quadrature, directions=np.asarray(quadrature.directions), weights=floats(7)
        ),
        "cube_map": of(s.cube_map, resolution=2),
        "fibonacci": of(s.fibonacci, count=7),
        "gauss_legendre": of(s.gauss_legendre, degree=2),
        "irradiance": of(s.irradiance, light=floats(3, K), normals=floats(V, 3), finite="light"),
        "lat_long": of(s.lat_long, height=4, width=8),
        "project": of(s.project, values=floats(3, 7), quadrature=quadrature, degree=2),
        "project_lat_long": of(s.project_lat_long, image=floats(6, 12, 3), degree=2),
        "reconstruct": of(s.reconstruct, coefficients=floats(3, K), directions=floats(7, 3)),
        "reconstruct_lat_long": of(
            s.reconstruct_lat_long, coefficients=floats(3, K), height=4, width=8
        ),
    }


def of_transfer():
    t = transfer
    light, flags = floats(3, K), {"distant": True, "normalized": True}
    return {
        "Material": of(
            t.Material,
            diffuse=floats(V, 3),
            specular=0.5,
            exponent=floats(V),
            finite="diffuse specular exponent",
        ),
        "Transfer": of(
            t.Transfer,
            coefficients=floats(V, K),
            positions=floats(V, 3),
            normals=floats(V, 3),
            neighbors=np.zeros((V, 2), np.int32),
        ),
        "Transfer.truncated": of(made().truncated, degree=1),
        "FixedLight.__call__": of(
            t.fixed_light(light, made()), eye=eye(), material=material(), **flags, finite="eye"
        ),
        "FixedView.__call__": of(
            t.fixed_view(made(), eye(), material()), light=light, finite="light"
        ),
        "bake": of(
            t.bake,
            mesh=knot(),
            degree=1,
            directions=16,
            shadows=True,
            bounces=0,
            albedo=0.5,
            ray_bias=1e-4,
            offset=None,
            scene=None,
            seed=0,
            chunk=16,
            checkpoint=None,
            finite="albedo ray_bias",
            free="checkpoint",
            slow=True,
        ),
        "fixed_light": of(t.fixed_light, light=light, transfer=made(), finite="light"),
        "fixed_view": of(
            t.fixed_view,
            transfer=made(),
            eye=eye(),
            material=material(),
            degree=1,
            **flags,
            finite="eye",
        ),
        "load": of(t.load, path="no such file", host=True),
        "quantize": of(t.quantize, transfer=made()),
        "reflected_direction": of(
            t.reflected_direction,
            eye=eye(),
            positions=floats(V, 3),
            normals=floats(V, 3),
            distant=False,
            finite="eye",
        ),
        "sample": of(t.sample, transfer=made(), degree=1),
        "save": of(t.save, path="/dev/null/no/folder", transfer=made(), host=True),
        "shade_diffuse": of(
            t.shade_diffuse,
            light=light,
            transfer=made(),
            albedo=floats(V, 3),
            finite="light albedo",
        ),
        "shade_glossy": of(
            t.shade_glossy,
            light=light,
            transfer=made(),
            eye=eye(),
            material=material(),
            **flags,
            finite="light eye",
        ),
        "unshadowed": of(
            t.unshadowed,
            positions=floats(V, 3),
            normals=floats(V, 3),
            degree=2,
            neighbors=np.zeros((V, 2), np.int32),
        ),
    }


def glow(view, sun, haze):
    return haze * (1 + view @ sun)[:, None]


def model(view, sun):
    return (1 + view @ sun)[:, None]


@functools.cache
def plain_fit():
    axes = sky.Axis("θ", 0.0, 1.5), sky.Axis("haze", 1.0, 2.0)
    return sky.SkyFit(jnp.asarray(floats(1, 3, 3, 2)), jnp.eye(1), axes, False)


def of_sky():
    k = sky
    view, sun, haze = floats(4, 3), floats(4, 3), 3 + floats(4)
    light, fit = floats(3, 4), k.preetham_table("small", 1)
    both = {"sun": sun, "turbidity": haze}
    checked = {"space": "srgb", "check": "raise"}
    options = {
        "zenith": 1.5,
        "parity": True,
        "prefactor": None,
        "weight": None,
        "lawson": 0,
        "samples": [6, 6],
        "project": k.project,
        "solver": "qr",
        "max_steps": 9,
        "throw": True,
    }
    return {
        "SkyFit.__call__": of(
            lambda sun, turbidity: fit(sun, turbidity), **both, finite="sun turbidity"
        ),
        "SkyFit.truncated": of(fit.truncated, degree=1),
        "c_header": of(k.c_header, fit=plain_fit(), prefix="my_sky", free="prefix", host=True),
        "cie_radiance": of(
            k.cie_radiance,
            view=view,
            sun=sun,
            zenith_luminance=haze,
            kind=12,
            check="raise",
            finite="view sun zenith_luminance",
        ),
        "fit": of(
            k.fit,
            model=glow,
            parameters={"haze": (1.0, 2.0)},
            degree=1,
            terms=[3, 2],
            log=["haze"],
            mix=np.eye(1),
            **options,
            slow=True,
            finite="mix",
        ),
        "fit_error": of(k.fit_error, approximate=light, exact=light, smallest=floats(3)),
        "habel2008_evaluate": of(
            k.habel2008_evaluate,
            table=floats(4, 3, 2, 3),
            theta=floats(4),
            turbidity=haze,
            host=True,
        ),
        "habel2008_fit": of(
            k.habel2008_fit,
            terms=(4, 3),
            turbidity=(2.5, 6.0),
            degree=1,
            constants="paper",
            slow=True,
        ),
        "habel2008_monomials": of(k.habel2008_monomials, fit=plain_fit(), host=True),
        "horizontal_irradiance": of(
            k.horizontal_irradiance, coefficients=light, finite="coefficients"
        ),
        "hosek_radiance": of(
            k.hosek_radiance,
            view=view,
            **both,
            albedo=floats(4),
            check="raise",
            finite="view sun turbidity albedo",
        ),
        "least_squares": of(
            k.least_squares,
            design=floats(5, 2),
            targets=floats(3, 5),
            scales=floats(3, 5),
            solver="qr",
            max_steps=9,
            slow=True,
            finite="design targets scales",
        ),
        "preetham_constants": of(k.preetham_constants, name="paper"),
        "preetham_fit": of(
            k.preetham_fit, terms=(4, 3), turbidity=(3.0, 4.0), degree=1, lawson=0, slow=True
        ),
        "preetham_harmonics": of(
            k.preetham_harmonics,
            **both,
            degree=1,
            window="habel",
            table="small",
            finite="sun turbidity",
        ),
        "preetham_radiance": of(
            k.preetham_radiance,
            view=view,
            **both,
            constants="paper",
            **checked,
            finite="view sun turbidity",
        ),
        "preetham_table": of(k.preetham_table, table="small", degree=1),
        "project": of(k.project, model=model, sun=sun, degree=1, symmetric=True, finite="sun"),
        "project_preetham": of(
            k.project_preetham,
            **both,
            degree=1,
            constants="paper",
            **checked,
            finite="sun turbidity",
        ),
        "smallest_luminance": of(
            k.smallest_luminance, **both, reading="luminance", degree=1, finite="sun turbidity"
        ),
        "sun_harmonics": of(
            k.sun_harmonics, **both, degree=1, radius=0.005, **checked, finite="sun turbidity"
        ),
        "sun_radiance": of(k.sun_radiance, **both, **checked, finite="sun turbidity"),
        "with_ground": of(k.with_ground, light=light, albedo=floats(3), finite="light albedo"),
        "xyz_to_srgb": of(k.xyz_to_srgb),
    }


@functools.cache
def ball():
    """Thirty vertices, as many as the methods of `adaptive` need."""
    points = sphere.fibonacci(30).directions
    return transfer.unshadowed(points, points, 2)


def of_adaptive():
    a = adaptive
    made, flags = ball(), {"distant": True, "normalized": True}
    rule = {"directions": 9, "exponent": 8.0}
    tiling = {"num_tiles": 2, "block": 8}
    frame = {"light": floats(3, K), "eye": eye(), "material": transfer.Material(0.5, 0.5, 8.0)}
    anchors, tiles = a.make_anchors(made), a.make_tiles(made, eye(), **tiling, **rule)
    atlas = a.make_tile_atlas(made, views=2, **tiling, **rule)
    shared = {
        "threshold": 0.02,
        "exposure": 1.0,
        "base": 2,
        "fallback": "level",
        "rings": 0,
        "smoothing": False,
        "previous": None,
        "hysteresis": 1.0,
        **flags,
    }
    looks = {"finite": "light eye", "host": True}
    return {
        "AnchorSet.__call__": of(
            anchors, **frame, threshold=0.1, exposure=1.0, **flags, **looks, slow=True
        ),
        "Anchors": of(
            a.Anchors,
            anchors=anchors,
            share=0.1,
            base=1,
            quantized=True,
            threshold=0.1,
            exposure=1.0,
            **flags,
        ),
        "Levels": of(a.Levels, **shared, diffuse_threshold=0.1),
        "Masks": of(a.Masks, **shared, diffuse_threshold=0.1),
        "TileFollower": of(
            a.TileFollower, atlas=atlas, transfer=made, eye=eye(), keep=3, finite="eye", slow=True
        ),
        "TileAtlas.nearest": of(
            atlas.nearest, transfer=made, eye=eye(), diffuse=None, finite="eye", slow=True
        ),
        "TileAtlas.tiling": of(atlas.tiling, view=1, host=True),
        "TileSet.__call__": of(tiles, **frame, **flags, finite="light eye"),
        "Tiles": of(a.Tiles, tiles=tiles, **tiling, **rule, quantized=True, **flags),
        "TwoStage": of(a.TwoStage, **shared, middle=2),
        "arrange": of(
            a.arrange,
            transfer=made,
            tiling=tiles.tiling,
            **rule,
            quantized=True,
            diffuse=made,
            slow=True,
        ),
        "make_anchors": of(
            a.make_anchors,
            transfer=made,
            share=0.2,
            base=1,
            quantized=True,
            diffuse=made,
            slow=True,
        ),
        "make_tile_atlas": of(
            a.make_tile_atlas, transfer=made, distance=3.0, views=2, **tiling, **rule, slow=True
        ),
        "make_tiles": of(
            a.make_tiles,
            transfer=made,
            eye=eye(),
            distant=False,
            **tiling,
            **rule,
            quantized=True,
            diffuse=made,
            finite="eye",
            slow=True,
        ),
        "make_tiling": of(
            a.make_tiling,
            transfer=made,
            eye=eye(),
            distant=False,
            **tiling,
            areas=floats(30),
            finite="eye",
            slow=True,
        ),
        "shade": of(
            a.shade,
            light=floats(3, K),
            transfer=made,
            eye=eye(),
            material=frame["material"],
            method="masks",
            finite="light eye",
        ),
        "stage": of(a.stage, transfer=made, degree=2, middle=2, base=1, quantized=True),
    }


def lamp():
    corners = [[0.0, 0.0, 1.0], [0.0, 3.0, 1.0], [2.0, 3.0, 1.0], [2.0, 0.0, 1.0]]
    return midrange.Polygon(np.array(corners), np.ones(3))


def of_inverse():
    i = inverse
    data = {"observed": floats(V, 3), "transfer": made(), "albedo": floats(V, 3)}
    solver = {"weights": floats(V), "tolerance": 1e-5, "max_steps": 3, "throw": True}
    finite = {"finite": "observed albedo weights", "slow": True}
    return {
        "fit_colors": of(i.fit_colors, **data, lights=[lamp()], upper=9.0, **solver, **finite),
        "fit_polygons": of(i.fit_polygons, **data, start=[lamp()], turn=True, **solver, **finite),
        "fit_sky": of(
            i.fit_sky,
            **data,
            sky=model,
            turbidity=(2.5, 6.0),
            exposure=1.0,
            starts=2,
            **solver,
            **finite,
        ),
        "rectangle_of": of(i.rectangle_of, polygon=lamp()),
    }


def of_plot():
    p, one = plot, np.array([[1.0, 0.0, 3.0, 4.0]])
    return {
        "bands": of(
            p.bands, coefficients=one, labels=["f"], ax=None, finite="coefficients", slow=True
        ),
        "light": of(p.light, light=one, height=4, exposure=1.0, ax=None, finite="light", slow=True),
        "lobes": of(
            p.lobes,
            coefficients=one,
            titles=["f"],
            same_scale=True,
            resolution=8,
            ax=None,
            finite="coefficients",
            slow=True,
        ),
    }


def of_geometry():
    g = geometry
    mesh, file = knot(), {"path": "no such file.ply", "up": "z"}
    rays = {
        "origins": floats(4, 3).astype(np.float32),
        "directions": floats(4, 3).astype(np.float32),
    }
    corners = np.array([[0.0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]])
    scene = g.JaxRayScene(mesh)
    made = {"normals": "smooth", "origin": (0.0, 0.0, 0.0), "two_sided": True}
    return {
        "EmbreeRayScene": of(g.EmbreeRayScene, meshes=[mesh], slow=True),
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
        "ray_scene": of(g.ray_scene, meshes=[mesh], slow=True),
        "read_mesh": of(
            g.read_mesh, **file, colors="srgb", **made, free="path normals origin", slow=True
        ),
        "topology": of(g.topology, mesh=mesh, host=True),
        "trace": of(
            g.trace, tree=scene.tree, **rays, max_distance=3.0, first=True, count=None, lanes=8
        ),
        "vertex_normals": of(g.vertex_normals, vertices=mesh.vertices, faces=mesh.faces),
        "write_mesh": of(g.write_mesh, path="/dev/null/no/knot.ply", mesh=mesh, up="z", slow=True),
    }


def of_imaging():
    i = imaging
    image, mesh = floats(6, 12, 3), knot()
    camera = i.Camera((0.3, -4.0, 0.2), (0.0, 0.0, 0.0), width=6, height=8)
    raster = i.rasterize(mesh, camera)
    return {
        "Camera": of(
            i.Camera,
            position=eye(),
            target=np.zeros(3),
            up=np.array([0.0, 0.0, 1.0]),
            fov_y=40.0,
            width=6,
            height=8,
            finite="position target up fov_y",
        ),
        "Camera.facing": of(
            i.Camera.facing,
            mesh=mesh,
            toward=(0.0, -1.0, 0.2),
            fov_y=30.0,
            width=6,
            height=8,
            margin=0.05,
            free="toward",
            host=True,
            finite="fov_y margin",
        ),
        "auto_exposure": of(
            i.auto_exposure, image=image, mask=image[..., 0] > 0.5, percentile=90.0
        ),
        "backdrop": of(i.backdrop, environment=image, camera=camera),
        "interpolate": of(
            i.interpolate, raster=raster, values=floats(300, 3), background=floats(3)
        ),
        "look_up": of(i.look_up, environment=image, directions=floats(4, 3)),
        "psnr": of(i.psnr, image=image, reference=image, mask=image[..., 0] > 0.5, peak=1.0),
        "rasterize": of(
            i.rasterize,
            mesh=mesh,
            camera=camera,
            samples=1,
            scene=geometry.ray_scene(mesh),
            slow=True,
        ),
        "read_environment": of(
            i.read_environment,
            path="no such file.exr",
            layout="lat-long",
            orientation="jaxsh",
            encoding="srgb",
            layer="beauty",
            height=8,
            repair=True,
            free="path layer",
            slow=True,
        ),
        "srgb_decode": of(i.srgb_decode, signal=image),
        "srgb_encode": of(i.srgb_encode, linear=image),
        "studio": of(i.studio, height=8, width=16),
        "tone_map": of(i.tone_map, image=image, exposure=1.0, curve="reinhard", white=2.0),
        "write_image": of(
            i.write_image, path="/dev/null/no/a.exr", image=image, encoding=None, slow=True
        ),
    }


def of_midrange():
    m, light = midrange, lamp()
    points, positions = floats(4, 3), floats(V, 3)
    ball = m.Sphere(np.array([0.0, 0.0, 3.0]), 0.5, np.ones(3))
    scene, cube = m.Scene([light], [ball]), m.capture(m.Scene([light]), points[0], 2)
    samples = m.surface_samples([light], 4)
    expansions = m.Expansion(floats(5, 3), floats(5, 3, 4, 4))
    one = m.Expansion(floats(3), floats(3, 4, 4))
    baked = transfer.unshadowed(positions, floats(V, 3), 1)
    weights = m.inverse_distance_weights(positions, expansions.point)
    polygon = {"polygon": light, "point": points, "degree": 1}
    behind = {"horizon": np.array([0.0, 0.0, 1.0]), "blockers": [light]}
    grid = m.Grid(np.zeros(3), np.ones(3), (2, 2, 3))
    search = {"exponent": 6.0, "checks": 8, "seed": 0}

    def evaluate(points):
        return m.Expansion(points, np.ones((len(points), 3, 4, 4)))

    return {
        "EmissiveMesh": of(
            m.EmissiveMesh, mesh=knot(), radiance=np.ones(3), two_sided=False, finite="radiance"
        ),
        "Expansion": of(m.Expansion, point=floats(5, 3), terms=floats(5, 3, 9, 4)),
        "Expansion.truncated": of(one.truncated, order=1),
        "Grid": of(
            m.Grid, lower=np.zeros(3), upper=np.ones(3), shape=(2, 2, 3), finite="lower upper"
        ),
        "Grid.weights": of(grid.weights, positions=positions),
        "Polygon": of(
            m.Polygon,
            vertices=np.asarray(light.vertices),
            radiance=np.ones(3),
            two_sided=False,
            finite="vertices radiance",
        ),
        "RadianceCube": of(
            m.RadianceCube,
            radiance=floats(24, 3),
            distance=floats(24),
            plane_distance=floats(24),
            normal=floats(24, 3),
            point=floats(3),
        ),
        "Scene": of(
            m.Scene, emitters=[light], blockers=[ball], environment=floats(4, 8, 3), host=True
        ),
        "Sphere": of(
            m.Sphere,
            center=np.zeros(3),
            radius=0.5,
            radiance=np.ones(3),
            finite="center radius radiance",
        ),
        "SurfaceSamples": of(
            m.SurfaceSamples,
            points=floats(7, 3),
            normals=floats(7, 3),
            areas=floats(7),
            radiance=floats(7, 3),
        ),
        "capture": of(
            m.capture,
            scene=scene,
            point=points,
            resolution=2,
            rays="analytic",
            finite="point",
            slow=True,
        ),
        "extrapolate": of(m.extrapolate, expansion=one, positions=positions),
        "grid_around": of(m.grid_around, positions=positions, shape=(2, 2, 3), host=True),
        "interpolate": of(
            m.interpolate, expansions=expansions, weights=weights, positions=positions, rule="full"
        ),
        "inverse_distance_weights": of(
            m.inverse_distance_weights, positions=positions, points=points, exponent=4.0
        ),
        "make_expansion": of(
            m.make_expansion,
            point=points,
            coefficients=floats(4, 3, 9),
            gradient=floats(4, 3, 9, 3),
        ),
        "monomials": of(m.monomials, offsets=points, order=2),
        "moving_least_squares_weights": of(
            m.moving_least_squares_weights, positions=positions, points=floats(5, 3), exponent=2.0
        ),
        "place_samples": of(
            m.place_samples,
            positions=positions,
            count=2,
            method="kmeans",
            evaluate=evaluate,
            target=0.1,
            candidates=4,
            **search,
            slow=True,
        ),
        "polygon_harmonics": of(m.polygon_harmonics, **polygon, **behind, slow=True),
        "polygon_harmonics_with_gradient": of(
            m.polygon_harmonics_with_gradient, **polygon, **behind, slow=True
        ),
        "project_cube": of(m.project_cube, cube=cube, degree=1),
        "project_cube_with_gradient": of(
            m.project_cube_with_gradient, cube=cube, degree=1, gradient="edges"
        ),
        "project_surface": of(m.project_surface, samples=samples, point=points, degree=1),
        "project_surface_with_gradient": of(
            m.project_surface_with_gradient, samples=samples, point=points, degree=1
        ),
        "shade": of(
            m.shade,
            expansions=expansions,
            transfer=baked,
            albedo=floats(V, 3),
            weights=weights,
            rule="full",
            finite="albedo",
        ),
        "sphere_harmonics": of(m.sphere_harmonics, sphere=ball, point=points, degree=1),
        "sphere_harmonics_with_gradient": of(
            m.sphere_harmonics_with_gradient, sphere=ball, point=points, degree=1
        ),
        "surface_samples": of(m.surface_samples, emitters=[light], count=4, host=True),
        "taylor": of(m.taylor, cube=cube, degree=1, order=1),
        "update_samples": of(
            m.update_samples,
            points=points,
            candidates=floats(4, 3),
            positions=positions,
            evaluate=evaluate,
            target=0.1,
            release=0.05,
            limit=5,
            **search,
            slow=True,
        ),
    }


TABLES = {
    "harmonics": of_harmonics,
    "sphere": of_sphere,
    "transfer": of_transfer,
    "sky": of_sky,
    "adaptive": of_adaptive,
    "inverse": of_inverse,
    "plot": of_plot,
    "geometry": of_geometry,
    "imaging": of_imaging,
    "midrange": of_midrange,
}


@functools.cache
def table(module: str) -> dict[str, Call]:
    """The calls of a module's functions and constructors by name, methods as `Class.method`."""
    return TABLES[module]()


# Classes that functions make: not for a user to make by hand.
MADE = {
    "harmonics": set(),
    "sphere": set(),
    "adaptive": {"AbstractMethod", "AdaptiveResult", "StagedTransfer", "Tiling"},
    "inverse": {"Confidence", "Recovered", "Rectangle", "SkyLight", "Statistics"},
    "plot": set(),
    "geometry": {"BaseColor", "Hit", "Mesh", "RayScene", "RayTree", "Topology", "Trace"},
    "imaging": {"Raster"},
    "midrange": {"Update", "Weights"},
    "sky": {"Axis", "FitError", "PreethamConstants", "SkyFit", "SkyWarning", "Solution"},
    "transfer": {
        "AbstractTransfer",
        "QuantizedTransfer",
        "SampledTransfer",
    },
}
