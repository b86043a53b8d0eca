"""`jaxsh.transfer` at full size."""

import dataclasses

import jax
import jax.numpy as jnp

from jaxsh import sphere, transfer

from .shared import (
    DEGREE,
    K,
    V,
    baked,
    booleans,
    floats,
    integers,
    made_by,
    material,
    of,
)
from .sphere import suns

WITHOUT = {
    "Material": "holds what it is given",
    "Transfer.belongs_to": "compares arrays on the host, and where they are traced their shapes",
    "Material.ggx": "holds what it is given",
    "Transfer": "holds what it is given",
    "bake": "runs on the host: tests/transfer/test_bake_device.py lowers what it runs on a device",
    "bake_on": "runs on a cluster",
    "compress": "runs on the host",
    "sun_visibility": "casts rays in NumPy",
}


def compressed():
    """256 clusters of 8 components."""
    weights, cluster, codes = (
        jax.ShapeDtypeStruct(shape, dtype)
        for shape, dtype in (((8, V), jnp.int8), ((V,), jnp.uint8), ((256, 9, K), jnp.int16))
    )
    rest = floats(256, 9), floats(V, 3), floats(V, 3), integers(V, 16)
    return made_by(transfer.CompressedTransfer, weights, cluster, codes, *rest)


def calls():
    t = transfer
    made, light, own, eye = baked(), floats(3, K), floats(V, 3, K), floats(3)
    volume = made_by(lambda made: dataclasses.replace(made, surface="points", cosine=False), made)
    sampled, albedo = made_by(t.sample, made), floats(V, 3)
    still = made_by(t.fixed_light, light, made)
    view = made_by(t.fixed_view, made, eye, material())

    def visibility(seen, suns):
        draw = jnp.zeros(len(seen), jnp.uint32)
        return t.SunVisibility(seen, draw, suns.direction, suns.solid_angle)

    def sunny(suns, made, seen, albedo):
        return t.shade_sun(suns, made, visibility(seen, suns), albedo)

    def shining(suns, made, seen, eye, material):
        return t.shade_sun(suns, made, visibility(seen, suns), material=material, eye=eye)

    rough = made_by(t.Material.ggx, albedo, floats(3), floats(V))
    discs = made_by(sphere.Suns, floats(16, 3), floats(16), floats(16, 3))
    return {
        "FixedLight.__call__": of(
            lambda still, eye, material: still(eye, material), still, eye, material()
        ),
        "FixedView.__call__": of(lambda view, light: view(light), view, light),
        "Transfer.truncated": of(lambda made: made.truncated(5), made),
        "shade_diffuse, compressed": of(t.shade_diffuse, light, compressed(), albedo),
        "shade_glossy, compressed": of(t.shade_glossy, light, compressed(), eye, material()),
        "fixed_light": of(t.fixed_light, light, made),
        "fixed_view": of(t.fixed_view, made, eye, material()),
        "fluence": of(t.fluence, light, volume),
        "fluence, own lights": of(t.fluence, own, volume),
        "quantize": of(t.quantize, made),
        "reflected_direction": of(t.reflected_direction, eye, floats(V, 3), floats(V, 3)),
        "sample": of(t.sample, made),
        "shade_diffuse": of(t.shade_diffuse, light, made, albedo),
        "shade_diffuse, own lights": of(t.shade_diffuse, own, made, albedo),
        "shade_diffuse, sampled": of(t.shade_diffuse, light, sampled, albedo),
        "shade_diffuse, quantized": of(
            lambda light, made, albedo: t.shade_diffuse(light, t.quantize(made), albedo),
            light,
            made,
            albedo,
        ),
        "shade_glossy": of(t.shade_glossy, light, made, eye, material()),
        "shade_glossy, own lights": of(t.shade_glossy, own, made, eye, material()),
        "shade_glossy, sampled": of(t.shade_glossy, light, sampled, eye, material()),
        "shade_glossy, rough": of(t.shade_glossy, floats(3, 9), baked(degree=2), eye, rough),
        "shade_sun": of(sunny, discs, made, booleans(V, 16, 16), albedo),
        "shade_sun.glossy": of(shining, suns(), made, booleans(V, 16, 16), eye, material()),
        "unshadowed": of(
            lambda p, n, near: t.unshadowed(p, n, DEGREE, neighbors=near),
            floats(V, 3),
            floats(V, 3),
            integers(V, 16),
        ),
    }
