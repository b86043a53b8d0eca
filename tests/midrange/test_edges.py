"""The edge form of the gradient: a loop over texels, and lights that are partly hidden."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from blocked import configuration, visible, visible_gradient
from cubes import random_cube
from lights import rectangle, surface_quadrature

from jaxsh import harmonics
from jaxsh.midrange import (
    Polygon,
    Scene,
    capture,
    project_cube_with_gradient,
)
from jaxsh.midrange._edges import edge_table
from jaxsh.sphere import cube_map


def edges(cube, degree):
    return np.asarray(project_cube_with_gradient(cube, degree, gradient="edges")[1])


def slow_edges(cube, degree):
    """Each pair of texels whose corners share two: a plane through both corners divides them."""
    resolution, centers = cube.resolution, np.asarray(cube.directions)
    on_cube = centers / np.abs(centers).max(axis=-1, keepdims=True)
    normals, offsets = np.asarray(cube.normal), np.asarray(cube.plane_distance)
    gradient = np.zeros((3, (degree + 1) ** 2, 3))
    corners = []
    for center in on_cube:
        face = np.abs(center).argmax()
        a, b = np.delete(np.eye(3), face, axis=0) / resolution
        around = [center + i * a + j * b for i in (-1, 1) for j in (-1, 1)]
        corners.append({tuple(np.round(corner * resolution).astype(int)) for corner in around})
    found = 0
    for a in range(len(centers)):
        for b in range(a):
            shared = [np.array(p) / np.linalg.norm(p) for p in corners[a] & corners[b]]
            if len(shared) != 2:
                continue
            found += 1
            normal = np.cross(*shared)
            normal *= np.arccos(shared[0] @ shared[1]) / np.linalg.norm(normal)
            normal *= np.sign(normal @ (centers[b] - centers[a]))
            middle = sum(shared) / np.linalg.norm(sum(shared))
            near = max(0, *(normals[t] @ middle / offsets[t] for t in (a, b)))
            basis = np.asarray(harmonics.evaluate(middle, degree))
            jump = np.asarray(cube.radiance[b] - cube.radiance[a])
            gradient += near * np.einsum("c,k,d->ckd", jump, basis, normal)
    assert found == 12 * resolution**2
    return gradient


def test_equals_a_loop_over_pairs_of_texels(rng):
    cube = random_cube(rng, resolution=3)
    exact = slow_edges(cube, 2)
    np.testing.assert_allclose(edges(cube, 2), exact, rtol=0, atol=1e-13 * np.abs(exact).max())


@pytest.mark.parametrize("resolution", [1, 2, 5])
def test_edges_are_arcs_between_texels(resolution):
    """Their number, those of the seams as long as the cube's twelve edges, and all turned right."""
    table = edge_table(resolution, 0, jnp.float64)
    assert len(table.centers) == 12 * resolution**2
    assert table.seams.shape == (2, 12 * resolution)
    lengths = np.linalg.norm(table.normals, axis=-1)
    np.testing.assert_allclose(
        np.sum(lengths[-12 * resolution :]), 12 * np.arccos(1 / 3), rtol=1e-13
    )
    np.testing.assert_allclose(
        np.sum(table.normals * table.centers, axis=-1), 0, rtol=0, atol=1e-15
    )
    centers = np.asarray(cube_map(resolution).directions)
    first, second = table.seams
    across = np.asarray(table.normals[-12 * resolution :])
    assert (np.sum(across * (centers[second] - centers[first]), axis=-1) > 0).all()


@pytest.mark.slow
def test_lights_that_are_partly_hidden():
    """24 random ones at 64²; the paper's form is blind to what moves before a light."""
    rng = np.random.default_rng(2004)
    cast = jax.jit(
        lambda light, radiance, blocker, point: project_both(
            capture(
                Scene([Polygon(light, radiance)], [Polygon(blocker, radiance)]),
                point,
                rays="analytic",
            )
        )
    )
    errors = []
    for _ in range(24):
        light, radiance, blocker, point = configuration(rng)
        exact = visible_gradient(light, radiance, blocker, point, 4)
        c, surface, edge = cast(light, radiance, blocker, jnp.asarray(point))
        exact_c = visible(light, radiance, blocker, point, 4)
        errors.append([relative(c, exact_c), relative(surface, exact), relative(edge, exact)])
    c, surface, edge = np.median(errors, axis=0)
    # 0.7, 2.5 and 65 % measured.
    assert c < 0.008
    assert edge < 0.03
    assert surface > 0.6


def project_both(cube):
    c, surface = project_cube_with_gradient(cube, 4, gradient="surface")
    return c, surface, project_cube_with_gradient(cube, 4, gradient="edges")[1]


def relative(a, b):
    return np.linalg.norm(a - b) / np.linalg.norm(b)


@pytest.mark.slow
@pytest.mark.parametrize(("resolution", "limit"), [(64, 0.03), (256, 0.003)])
def test_one_light_that_nothing_hides(resolution, limit):
    """Both forms against quadrature over the light: within 3 % at 64², 0.3 % at 256²."""
    light = rectangle([0.3, -0.2, 2], [0.6, 0.1, 0], [0, -0.5, 0.2])
    radiance, point = np.array([1.0, 2, 3]), np.array([0.1, 0.2, -0.1])
    exact, slope = surface_quadrature(light, radiance, point, 4)
    cube = capture(
        Scene([Polygon(light, radiance)]), jnp.asarray(point), resolution, rays="analytic"
    )
    c, surface, edge = project_both(cube)
    assert relative(c, exact) < limit
    assert relative(surface, slope) < limit
    assert relative(edge, slope) < limit


@pytest.mark.slow
def test_edges_jit_vmap_and_float32(rng):
    cube = random_cube(rng, resolution=2, batch=(2,))
    gradient = edges(cube, 2)
    mapped = jax.jit(jax.vmap(lambda c: project_cube_with_gradient(c, 2, gradient="edges")[1]))(
        cube
    )
    np.testing.assert_allclose(mapped, gradient, rtol=0, atol=1e-13)
    single = jax.tree.map(lambda a: a.astype(jnp.float32), cube)
    c, got = project_cube_with_gradient(single, 2, gradient="edges")
    assert c.dtype == got.dtype == jnp.float32
    np.testing.assert_allclose(got, gradient, rtol=0, atol=1e-5 * np.abs(gradient).max())


def test_nothing_seen_has_no_edge_gradient():
    cube = capture(Scene([], environment=np.zeros((2, 4, 3))), jnp.zeros(3), 4, rays="analytic")
    assert not edges(cube, 2).any()


def test_refuses_an_unknown_gradient(rng):
    with pytest.raises(ValueError, match="gradient must be one of"):
        project_cube_with_gradient(random_cube(rng, 1), 2, gradient="visible")
