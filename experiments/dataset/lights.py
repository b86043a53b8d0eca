"""Lights of a dataset: probes, each turned about the vertical, and the suns of a day."""

import dataclasses
import datetime
import math
from typing import Any

import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from jaxsh import geometry, harmonics, sky, sphere, transfer

from ..runner import Context, UserError
from .sources import environment

# Of the sun's visibility from each vertex.
_RAYS = 16


@dataclasses.dataclass(frozen=True)
class Light:
    """What shines, as coefficients, and the sun's disc where one is in the sky."""

    about: dict[str, Any]  # for lights.json
    coefficients: Float[Array, "3 k"]
    sun: sphere.Suns | None = None

    def told(self) -> dict[str, Any]:
        """The light as JSON."""
        found = self.about | {"coefficients": np.asarray(self.coefficients).tolist()}
        if self.sun is None:
            return found | {"sun": None}
        sun = {
            "direction": np.asarray(self.sun.direction)[0].tolist(),
            "solid_angle": float(self.sun.solid_angle[0]),
            "radiance": np.asarray(self.sun.radiance)[0].tolist(),
        }
        return found | {"sun": sun}

    def radiance(
        self,
        mesh: geometry.Mesh,
        baked: transfer.Transfer,
        bounced: transfer.Transfer | None,
        scene: geometry.RayScene,
    ) -> Float[Array, "v 3"]:
        """What leaves a white surface at each vertex; cut off below zero.

        `bounced` is the part of `baked` that bounces: the sun's light reaches the surface directly
        along rays, with shadows that have an edge, and otherwise by harmonics.
        """
        shaded = transfer.shade_diffuse(self.coefficients, baked, 1.0)
        if self.sun is not None:
            seen = transfer.sun_visibility(self.sun, mesh, scene, rays=_RAYS)
            shaded = shaded + transfer.shade_sun(self.sun, mesh, seen, 1.0)
            if bounced is not None:
                light = self.sun.harmonics(baked.degree)
                shaded = shaded + transfer.shade_diffuse(light, bounced, 1.0)
        return jnp.maximum(shaded, 0)


def of_probes(context: Context, names: tuple[str, ...], turns: int, degree: int) -> list[Light]:
    """Each environment turned about z by the whole circle's `turns` equal parts."""
    lights = []
    for name in names:
        probe = sphere.project_lat_long(environment(context, name), degree)
        for turn in range(turns):
            angle = 2 * math.pi * turn / turns
            c, s = math.cos(angle), math.sin(angle)
            rotation = jnp.asarray([[c, -s, 0], [s, c, 0], [0, 0, 1]], probe.dtype)
            about = {"kind": "probe", "name": name, "turn_degrees": math.degrees(angle)}
            lights.append(Light(about, harmonics.rotate(probe, rotation)))
    return lights


def of_day(
    count: int,
    degree: int,
    *,
    day: str,
    latitude: float,
    longitude: float,
    turbidity: float,
    ground: float,
) -> list[Light]:
    """Sun and sky at `count` times from sunrise to sunset, evenly, over a gray ground."""
    try:
        noon = datetime.datetime.fromisoformat(day).replace(hour=12, tzinfo=datetime.UTC)
    except ValueError:
        raise UserError(f"day: expected a date such as 2026-06-21, got {day!r}") from None
    # Every half minute about noon of the sun.
    times = noon.timestamp() - longitude / 15 * 3600 + 30.0 * np.arange(-1440, 1441)
    try:
        heights = np.asarray(sky.sun_direction(times, latitude, longitude))[:, 2]
    except (ImportError, ValueError) as error:
        raise UserError(f"suns of a day: {error}") from None
    up = times[heights > 0.05]
    if not len(up):
        raise UserError(f"the sun does not rise on {day} at latitude {latitude:g}")
    chosen = up[0] + (up[-1] - up[0]) * (np.arange(count) + 0.5) / count
    lights = []
    for time in chosen:
        sun = sky.sun_direction(float(time), latitude, longitude)
        dome = sky.preetham_harmonics(sun, turbidity, degree)
        both = dome + sky.sun_harmonics(sun, turbidity, degree)
        bounced = sky.with_ground(both, ground) - both  # what the ground sends up
        solid_angle = 4 * math.pi * math.sin(sky.SUN_RADIUS / 2) ** 2
        disc = sphere.Suns(
            sun[None], jnp.asarray([solid_angle]), sky.sun_radiance(sun, turbidity)[None]
        )
        said = datetime.datetime.fromtimestamp(float(time), datetime.UTC)
        about = {
            "kind": "day",
            "time": said.isoformat(timespec="seconds"),
            "latitude": latitude,
            "longitude": longitude,
            "turbidity": turbidity,
        }
        lights.append(Light(about, dome + bounced, disc))
    return lights
