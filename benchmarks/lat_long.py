"""A lat-long picture to coefficients and back, beside evaluate-everything-and-multiply."""

import functools
from collections.abc import Iterator
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np

from experiments.runner import Column
from experiments.shared.timing import interleaved, ratio
from jaxsh import sphere

from ._sections import Cores, Section


def timings(cores: Cores, rounds: int, dtype: str) -> Iterator[dict[str, Any]]:
    """Rows of one picture and degree."""
    yield from _timings(10, 256, rounds)


def _timings(degree: int, height: int, rounds: int) -> list[dict[str, Any]]:
    """Projection and reconstruction of an RGB picture, float32."""
    from . import _peers

    width = 2 * height
    image = jnp.asarray(np.random.default_rng(0).random((height, width, 3)), jnp.float32)
    quadrature = sphere.lat_long(height, width)
    directions = jnp.asarray(quadrature.directions, jnp.float32)
    weights = jnp.asarray(quadrature.weights, jnp.float32)
    light = sphere.project_lat_long(image, degree)

    def peer_project(image):
        basis = _peers.sphericart_values(directions, degree)
        return (image.reshape(-1, 3) * weights[:, None]).T @ basis

    def peer_reconstruct(light):
        return (light @ _peers.sphericart_values(directions, degree).T).T.reshape(image.shape)

    project = {
        "separable": lambda i: sphere.project_lat_long(i, degree),
        "streamed": lambda i: sphere.project(i.reshape(-1, 3).T, quadrature, degree),
        "sphericart": peer_project,
    }
    reconstruct = {
        "separable": lambda c: sphere.reconstruct_lat_long(c, height, width),
        "streamed": lambda c: sphere.reconstruct(c, directions),
        "sphericart": peer_reconstruct,
    }
    rows = []
    for quantity, functions, argument in [
        ("project", project, image),
        ("reconstruct", reconstruct, light),
    ]:
        calls = {n: functools.partial(jax.jit(f), argument) for n, f in functions.items()}
        times = interleaved(calls, rounds=rounds)
        rows.append(
            {
                "quantity": quantity,
                "picture": f"{width}×{height}×3",
                "degree": degree,
                "ours_ms": times["separable"].median_ms,
                "compile_s": times["separable"].first_seconds,
                "streamed": ratio(times["streamed"], times["separable"]),
                "sphericart": ratio(times["sphericart"], times["separable"]),
            }
        )
    return rows


SECTION = Section(
    name="lat_long",
    title="Lat-long pictures",
    intro="To coefficients and back, float32, by separable sums; the others in times of these.",
    columns=[
        Column("quantity", "quantity"),
        Column("picture", "picture"),
        Column("degree", "degree"),
        Column("ours_ms", "separable, ms", digits=2),
        Column("streamed", "streamed / separable", digits=1),
        Column("sphericart", "sphericart + matmul / separable", digits=1),
        Column("compile_s", "first call, s", digits=2),
    ],
    timings=timings,
    peers=("sphericart-jax",),
)
