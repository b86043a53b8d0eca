"""The ways to shade a frame that the experiments on Lee & Kim 2014 time against each other."""

import functools
import itertools
import math
import statistics
from collections.abc import Callable, Iterable, Mapping
from typing import Any, Literal, get_args

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from jaxsh import adaptive, transfer
from jaxsh.harmonics import convolve, evaluate, phong, product_matrix

from ..runner import Context
from ..shared.timing import bursts
from .scenes import Quality, Scene

# "probes" are the anchors of `adaptive`: the tables keep the name under which they began.
Method = Literal["masks", "levels", "two_stage", "probes", "tiles"]
METHODS: tuple[Method, ...] = get_args(Method)
FILTERS = "masks", "levels", "two_stage"
THRESHOLD, DIFFUSE_THRESHOLD = 0.02, 0.01  # the paper's
STILL = "eye product"
DIFFUSE, EIGHT_BITS = "diffuse", "diffuse, eight bits"
_BURST = 3  # frames of one way, before the next takes its turn
_TILE = 1024  # vertices of the product form's tiles
TURN = 0.05  # of the light from frame to frame, in radians
TURNS = 21  # of the light around the vertical, among which the worst error is sought

Light = Float[Array, "3 k"]
Way = Callable[[Light], Any]


def baselines(scene: Scene) -> dict[str, Way]:
    """The full computation in three forms, slowest first."""
    sampled = transfer.sample(scene.baked)
    rest = scene.baked, scene.eye, scene.material
    return {
        "einsum": lambda light: _einsum(light, *rest),
        "product form": lambda light: _product_form(light, *rest),
        "full": lambda light: transfer.shade_glossy(light, sampled, *rest[1:]),
    }


def still(scene: Scene) -> dict[str, Way]:
    """The full computation for an eye that stands still, with all done before that can be."""
    return {STILL: transfer.fixed_view(scene.baked, scene.eye, scene.material)}


def diffuse(scene: Scene) -> dict[str, Way]:
    """The diffuse part alone, in float32 and in eight bits."""

    def way(baked: transfer.Transfer | transfer.QuantizedTransfer) -> Way:
        return lambda light: transfer.shade_diffuse(light, baked, scene.material.diffuse)

    return {DIFFUSE: way(scene.baked), EIGHT_BITS: way(transfer.quantize(scene.baked))}


def adaptive_way(scene: Scene, method: Method, **options: Any) -> Way:
    """A frame by one of the methods, with what it needs made; gives an `AdaptiveResult`."""
    baked: transfer.AbstractTransfer = scene.baked
    if method in FILTERS:
        # At degree 2 the paper's base leaves nothing to add.
        base = min(2, scene.row.degree - 1)
        options = {"threshold": THRESHOLD, "base": base} | options
        if method == "two_stage":
            options.pop("diffuse_threshold", None)  # it decides on the glossy part alone
            baked = adaptive.stage(scene.baked, scene.row.degree, base=options["base"])
            made = adaptive.TwoStage(**options)
        else:
            options = {"diffuse_threshold": DIFFUSE_THRESHOLD} | options
            made = {"masks": adaptive.Masks, "levels": adaptive.Levels}[method](**options)
    elif method == "probes":
        made = adaptive.Anchors(adaptive.make_anchors(scene.baked), **options)
    else:
        exponent = float(scene.material.lobe[1])
        tiles = adaptive.make_tiles(scene.baked, scene.eye, exponent=exponent)
        made = adaptive.Tiles(tiles, **options)
    return lambda light: adaptive.shade(light, baked, scene.eye, scene.material, made)


def truncations(scene: Scene) -> dict[str, Way]:
    """The trivial rival: everyone stops at a lower degree."""

    def way(degree: int) -> Way:
        lower = scene.cut(degree)
        sampled, count = transfer.sample(lower.baked), lower.light.shape[1]
        return lambda light: transfer.shade_glossy(
            light[:, :count], sampled, scene.eye, scene.material
        )

    target = scene.row.degree
    return {f"degree {degree}": way(degree) for degree in range(max(2, target - 6), target)}


def warm(context: Context, label: str, ways: Mapping[str, Way], light: Light) -> dict[str, Any]:
    """The first frame of each way, which compiles: what it gives."""
    with context.time(f"{label}: first frames, which compile"):
        return {name: jax.block_until_ready(way(light)) for name, way in ways.items()}


def seconds(ways: Mapping[str, Way], lights: Iterable[Light]) -> dict[str, float]:
    """The median frame of each way; they take turns of a few frames, as an animation has them."""
    taken = bursts(ways, ((light,) for light in lights), length=_BURST)
    return {name: statistics.median(itertools.chain(*turns)) for name, turns in taken.items()}


def lights(scene: Scene, frames: int) -> list[Light]:
    """The scene's light, turning; its own direction is left to the errors."""
    return [scene.turned(TURN * (frame + 1)) for frame in range(frames)]


def worst_turns(scene: Scene, full: Way, ways: Mapping[str, Way]) -> dict[str, float]:
    """The least object PSNR of each way, in dB, while the light turns once around the vertical."""
    worst = dict.fromkeys(ways, math.inf)
    for angle in np.arange(TURNS) * 2 * np.pi / TURNS:
        light = scene.turned(float(angle))
        reference = full(light)
        for name, way in ways.items():
            quality = scene.quality(color(way(light)), reference)
            worst[name] = min(worst[name], quality.object)
    return worst


def color(result: Any) -> Float[Array, "v 3"]:
    return result.color if isinstance(result, adaptive.AdaptiveResult) else result


def rival(spent: float, times: Mapping[str, float], qualities: Mapping[str, Quality]):
    """The highest truncation that takes no longer than `spent`: its name and object PSNR.

    Where even the lowest takes longer it is the lowest; "full" where the full computation does not.
    """
    if times["full"] <= spent:
        return {"rival": "full", "rival_psnr_object": math.inf}
    names = list(qualities)
    name = next((n for n in reversed(names) if times[n] <= spent), names[0])
    return {"rival": name, "rival_psnr_object": qualities[name].object}


@jax.jit
def _einsum(light, baked, eye, material):
    kernel = _kernel(baked, eye, material, light.shape[-1])
    glossy = jnp.einsum(
        "iv,cij,vj->vc", kernel, product_matrix(light), baked.coefficients, precision="highest"
    )
    return material.specular * glossy + transfer.shade_diffuse(light, baked, material.diffuse)


def _kernel(baked, eye, material, width: int) -> Float[Array, "k v"]:
    return _lobe(transfer.reflected_direction(eye, baked.positions, baked.normals), material, width)


def _lobe(axis, material, width: int) -> Float[Array, "k n"]:
    """α_i y_i(B), the harmonics first."""
    degree = math.isqrt(width) - 1
    lobe = phong(material.exponent, degree, normalized=True)
    alpha = convolve(jnp.ones(width, axis.dtype), lobe)
    return evaluate(axis, degree, axis=0) * alpha[:, None]


@jax.jit
def _product_form(light, baked, eye, material):
    width, (count, _) = light.shape[-1], baked.positions.shape
    rows = jnp.concatenate([product_matrix(light).reshape(-1, width), light])
    axis = transfer.reflected_direction(eye, baked.positions, baked.normals)

    def tile(part):
        coefficients, axis = part
        kernel = _lobe(axis, material, width)
        products = jnp.matmul(rows, coefficients.T, precision="highest")
        channels = products[:-3].reshape(3, width, -1)
        glossy = jnp.stack([jnp.sum(kernel * channel, axis=0) for channel in channels])
        return material.specular * glossy + material.diffuse / math.pi * products[-3:]

    def tiles(vertices):
        padded = jnp.pad(vertices, ((0, -count % _TILE), (0, 0)), mode="edge")
        return padded.reshape(-1, _TILE, vertices.shape[1])

    colors = jax.lax.map(tile, (tiles(baked.coefficients), tiles(axis)))
    return jnp.moveaxis(colors, 1, 2).reshape(-1, 3)[:count]


def product_flops(vertices: int, coefficients: int) -> int:
    """Of the product form: a multiplication and an addition for each of 3 K² and 3 K terms."""
    return 2 * vertices * 3 * coefficients * (coefficients + 1)


def matmul(size: int = 1024) -> tuple[Way, int]:
    """A square product in float32, which tells the machine's rate, and its operations."""
    left, right = jnp.asarray(
        np.random.default_rng(0).normal(size=(2, size, size)), dtype=jnp.float32
    )
    multiply = jax.jit(functools.partial(jnp.matmul, precision="highest"))
    return lambda _: multiply(left, right), 2 * size**3
