"""Valid calls of `jaxsh.transfer`."""

import dataclasses

import numpy as np

from jaxsh import sphere, transfer

from .shared import K, V, eye, floats, knot, made, material, of


def calls():
    t = transfer
    volume = dataclasses.replace(made(), surface="points", cosine=False)
    light, flags = floats(3, K), {"distant": True, "normalized": True}
    suns = sphere.Suns(floats(2, 3), floats(2), floats(2, 3))
    rays = {
        "surface": knot(),
        "degree": 1,
        "directions": 16,
        "shadows": True,
        "bounces": 0,
        "albedo": 0.5,
        "ray_bias": 1e-4,
        "offset": None,
        "seed": 0,
        "chunk": 16,
        "finite": "albedo ray_bias",
        "slow": True,
    }
    return {
        "Material": of(
            t.Material,
            diffuse=floats(V, 3),
            specular=0.5,
            exponent=floats(V),
            roughness=None,
            finite="diffuse specular exponent",
        ),
        "Material.ggx": of(
            t.Material.ggx,
            diffuse=floats(V, 3),
            specular=0.5,
            roughness=floats(V),
            finite="diffuse specular roughness",
        ),
        "Transfer": of(
            t.Transfer,
            coefficients=floats(V, K),
            positions=floats(V, 3),
            normals=floats(V, 3),
            neighbors=np.zeros((V, 2), np.int32),
            surface="points",
            cosine=False,
        ),
        "Material.sharded": of(material().sharded, devices=None, host=True),
        "SampledTransfer.sharded": of(t.sample(made()).sharded, devices=None, host=True),
        "QuantizedTransfer.sharded": of(t.quantize(made()).sharded, devices=None, host=True),
        "Transfer.sharded": of(made().sharded, devices=None, host=True),
        "CompressedTransfer.sharded": of(
            t.compress(made(), components=1).sharded, devices=None, host=True
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
            **rays,
            scene=None,
            device=None,
            store="/dev/null/no/folder",
            free="store",
        ),
        "bake_on": of(
            t.bake_on,
            client="tcp://nowhere",
            **rays,
            store="/dev/null/no/knot",
            scene=None,
            device=False,
            free="client store",
        ),
        "compress": of(
            t.compress,
            transfer=made(),
            clusters=1,
            components=1,
            iterations=1,
            seed=0,
            host=True,
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
        "Transfer.belongs_to": of(made().belongs_to, surface=knot()),
        "fluence": of(t.fluence, light=light, transfer=volume, finite="light"),
        "load": of(t.load, path="no such file", host=True),
        "open": of(t.open, path="no such folder", host=True),
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
        "shade_sun": of(
            t.shade_sun,
            suns=suns,
            surface=made(),
            scene=None,
            albedo=floats(V, 3),
            material=None,
            eye=None,
            shadows=False,
            **flags,
            finite="albedo",
        ),
        "shade_sun.glossy": of(
            t.shade_sun,
            suns=suns,
            surface=made(),
            scene=None,
            albedo=None,
            material=material(),
            eye=eye(),
            shadows=False,
            **flags,
            finite="eye",
        ),
        "shard_rows": of(t.shard_rows, values=floats(V, 3), devices=None, host=True, free="values"),
        "sun_visibility": of(
            t.sun_visibility,
            suns=suns,
            surface=knot(),
            scene=None,
            rays=4,
            ray_bias=1e-4,
            offset=None,
            seed=0,
            finite="ray_bias",
            slow=True,
        ),
        "unshadowed": of(
            t.unshadowed,
            positions=floats(V, 3),
            normals=floats(V, 3),
            degree=2,
            neighbors=np.zeros((V, 2), np.int32),
        ),
    }
