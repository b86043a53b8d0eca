"""What is computed on devices of one process, or of several that `jax.distributed` joins."""

import sys

import jax
import jax.numpy as jnp
import numpy as np
from jax.experimental import multihost_utils

from jaxsh import adaptive, inverse, sky, sphere, transfer

V, DEGREE = 33, 2
EYE = np.array([0.3, -2.0, 1.5])


def compute(devices, store: str) -> dict[str, np.ndarray]:
    """Shading, projections, a fit and gradients of points that the devices share, as a whole.

    `store`: of a transfer of the degree; each process reads its own part.
    """
    rng = np.random.default_rng(17)
    normals = np.asarray(sphere.fibonacci(V).directions)
    baked = transfer.unshadowed(0.3 * normals, normals, DEGREE)
    made = baked.sharded(devices)
    light, albedo = rng.normal(size=(3, 9)), rng.uniform(0.1, 1, (V, 3))
    material = transfer.Material(albedo, 0.3, rng.uniform(1, 9, V)).sharded(devices)
    rows, colors = (transfer.shard_rows(x, devices) for x in (albedo, rng.uniform(0.1, 1, (V, 3))))

    def loss(light, coefficients, made, rows):
        shown = transfer.Transfer(coefficients, made.positions, made.normals, made.neighbors)
        return jnp.sum((transfer.shade_diffuse(light, shown, rows) - 0.3) ** 2)

    slopes = jax.jit(jax.grad(loss, (0, 1)))(jnp.asarray(light), made.coefficients, made, rows)
    quadrature = sphere.fibonacci(V).sharded(devices)
    project = jax.jit(lambda values, quadrature: sphere.project(values.T, quadrature, DEGREE))
    found = inverse.fit_light(colors, made, rows, 1, prior=None)
    skies = sky.fit(glow, {}, degree=1, terms=[4], samples=[9], solver="qr", devices=devices)
    stored = transfer.open(store)
    read = transfer.shade_diffuse(light, stored.sharded(devices), 0.5)
    one = transfer.Material(0.5, 0.5, 8.0)
    near = adaptive.Levels(base=1, threshold=0.1, rings=1, smoothing=True)
    both = baked.sharded()  # sets hang on who has which vertices
    anchors, tiles = adaptive.make_anchors(both), adaptive.make_tiles(both, EYE, block=4)
    results = {
        "diffuse": transfer.shade_diffuse(light, made, rows),
        "glossy": transfer.shade_glossy(light, made, EYE, material),
        "levels": adaptive.shade(light, made, EYE, material, near).color,
        "stages": adaptive.shade(light, made, EYE, material, adaptive.TwoStage(base=1)).color,
        "anchors": anchors(light, EYE, one).color,
        "tiles": tiles(light, EYE, one).color,
        "projection": project(colors, quadrature),
        "fit": found.value,
        "deviation": found.confidence.deviation,
        "fit of a sky": skies.coefficients,
        "slope in the light": slopes[0],
        "slope in the coefficients": slopes[1],
    }
    whole = {name: _whole(array)[:V] for name, array in results.items()}
    return whole | {"diffuse, from a store": _whole(read)[: stored.num_points]}


def glow(view, sun):
    return jnp.exp(view @ sun)[:, None]


def _whole(array: jax.Array) -> np.ndarray:
    """All rows on each process."""
    if not array.is_fully_addressable and not array.is_fully_replicated:
        array = multihost_utils.process_allgather(array, tiled=True)
    return np.asarray(array)


if __name__ == "__main__":
    address, number, store, path = sys.argv[1:]
    jax.distributed.initialize(address, num_processes=2, process_id=int(number))
    assert (jax.process_count(), jax.local_device_count()) == (2, 1)
    np.savez(path, allow_pickle=False, **compute(None, store))
