"""Coefficients of a radiance cube, and their gradient with respect to the point."""

from jaxtyping import Array, Float

from .._core.checks import check_degree
from ._cube import RadianceCube
from ._edges import edge_gradient, edge_table
from ._taylor import each, project_cube, taylor


def project_cube_with_gradient(
    cube: RadianceCube, degree: int, *, gradient: str = "surface"
) -> tuple[Float[Array, "*batch 3 k"], Float[Array, "*batch 3 k 3"]]:
    """Coefficients (..., 3, K) of a cube's light, and d/d point of them, (..., 3, K, 3).

    With ω a texel's direction, dω its solid angle, t the tangential gradient of y at ω:

    - `"surface"`: ∇c = Σ L dω [(3ωy - t)/r - y n/h], eqs. 11 to 13 of Annen et al. 2004 with their
      signs put right, and 1/r, not the 1/r² of §4.2. What is visible is taken not to change (eq. 8
      leaves out the moving boundary): right for each light by itself, wrong, at any resolution,
      where a surface hides part of a light or one light part of another.
    - `"edges"`: ∇c = Σ_e (L_b - L_a) y ν (1/r)_near over the edges between texels, which is the
      moving boundary and nothing else: right under occlusion too, the same where nothing is hidden.

    Linear in the radiance; differentiable in all of the cube, in `"edges"` with kinks where the
    nearer of two surfaces changes. Zero from texels at infinity, and from planes seen edge on.
    Raises `ValueError` for a wrong degree or an unknown `gradient`.
    """
    if gradient == "surface":
        expansion = taylor(cube, degree, 1)
        return expansion.coefficients, expansion.gradient
    if gradient == "edges":
        table = edge_table(cube.resolution, check_degree(degree), cube.radiance.dtype)
        return project_cube(cube, degree), each(edge_gradient, cube, table)
    raise ValueError(f'gradient must be "surface" or "edges", got {gradient!r}')
