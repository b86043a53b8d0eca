"""The projection of a radiance cube against the paper's loop over texels, written out."""

import jax
import numpy as np
import pytest
from cubes import random_cube
from lights import basis_with_gradient

from jaxsh.midrange import (
    RadianceCube,
    project_cube,
    project_cube_with_gradient,
)


def by_the_paper(cube, degree):
    """Eqs. 11 to 13 texel by texel, each with its sign as it must be: dA = dω r²/(-n·ω)."""
    c, gradient = np.zeros((3, (degree + 1) ** 2)), np.zeros((3, (degree + 1) ** 2, 3))
    for t in range(len(cube.distance)):
        radiance, omega, r, n, solid_angle = (
            np.asarray(a[t], np.float64)
            for a in (cube.radiance, cube.directions, cube.distance, cube.normal, cube.solid_angles)
        )
        if np.isinf(r):
            y, _ = basis_with_gradient(omega[None], degree)
            c += np.outer(radiance, y) * solid_angle
            continue
        s, area = r * omega, solid_angle * r**2 / -(n @ omega)
        y, slope = (a[0] for a in basis_with_gradient(s[None], degree))
        g = -(n @ s) / r**3
        slope_of_g = -n / r**3 + 3 * s * (n @ s) / r**5
        integrand = slope * g + np.outer(y, slope_of_g)
        c += np.outer(radiance, y * g * area)
        gradient -= radiance[:, None, None] * integrand * area
    return c, gradient


@pytest.mark.parametrize(("dtype", "rtol"), [(np.float64, 1e-13), (np.float32, 2e-6)])
def test_equals_the_paper_s_loop(rng, dtype, rtol):
    cube = random_cube(rng, dtype=dtype)
    exact = by_the_paper(cube, 3)
    got = project_cube_with_gradient(cube, 3, gradient="surface")
    for a, b in zip(got, exact, strict=True):
        assert a.dtype == dtype
        np.testing.assert_allclose(a, b, atol=rtol * np.abs(b).max(), rtol=0)
    np.testing.assert_allclose(
        project_cube(cube, 3), exact[0], rtol=0, atol=rtol * np.abs(exact[0]).max()
    )


@pytest.mark.slow
def test_is_linear_in_the_radiance(rng):
    cube = random_cube(rng, resolution=1)

    @jax.jit
    @jax.jacrev
    def jacobians(radiance):
        return project_cube_with_gradient(
            RadianceCube(radiance, cube.distance, cube.plane_distance, cube.normal, cube.point), 1
        )

    values = project_cube_with_gradient(cube, 1)
    for value, slope in zip(values, jacobians(cube.radiance), strict=True):
        summed = np.tensordot(slope, cube.radiance, 2)
        np.testing.assert_allclose(summed, value, rtol=0, atol=1e-12)


def test_points_along_batch_axes(rng):
    cube = random_cube(rng, resolution=2, batch=(2, 3))
    c, gradient = project_cube_with_gradient(cube, 1)
    assert c.shape == (2, 3, 3, 4)
    assert gradient.shape == (2, 3, 3, 4, 3)
    assert project_cube(random_cube(rng, resolution=2, batch=(0,)), 1).shape == (0, 3, 4)


def test_refuses_texels_that_make_no_cube(unchecked, rng):
    cube = random_cube(rng, resolution=1)
    for count in (0, 5, 12):
        with pytest.raises(ValueError, match="expected N = 6·resolution² texels"):
            RadianceCube(
                np.zeros((count, 3)), np.zeros(count), np.zeros(count), np.zeros((count, 3)),
                np.zeros(3),
            )  # fmt: skip
    with pytest.raises(ValueError, match="in the same batch"):
        RadianceCube(
            cube.radiance, cube.distance, cube.plane_distance, cube.normal, np.zeros((2, 3))
        )
