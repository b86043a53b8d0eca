"""Error against bytes and time of compressed transfer, beside eight bits, float16 and all of it."""

import dataclasses
import time
from collections.abc import Callable, Iterator
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from jaxsh import sphere, transfer

from ..runner import Context, Table, experiment
from ..shared.plots import plain_numbers, plt, save
from ..shared.subjects import Subject, load
from ..shared.timing import interleaved, ratio

_BYTES = "relative RMS error of the diffuse color, mean of the environments, by bytes a vertex"
_ALBEDO = 0.5


@dataclasses.dataclass(frozen=True)
class Compression:
    meshes: tuple[str, ...] = ()
    """meshes by name; none means the first that the data has"""
    environments: tuple[str, ...] = ()
    """environments by name; none means all that the data has"""
    degree: int = 10
    """degree of light and transfer"""
    directions: int = 1024
    """directions of the bake"""
    sizes: tuple[tuple[int, int], ...] = ((64, 8), (256, 8), (256, 16), (512, 24))
    """clusters and components"""
    exponent: float = 32.0
    """of the glossy lobe"""
    rounds: int = 9
    """of the times, in turns"""

    def __post_init__(self):
        if not self.sizes or min(self.degree, self.directions, self.rounds) < 1:
            raise ValueError("degree, directions and rounds must be at least 1, sizes one or more")


class Form(NamedTuple):
    """A transfer in one form: its bytes without positions, and what it took to make it."""

    name: str
    transfer: transfer.AbstractTransfer
    bytes: int
    seconds: float
    glossy: bool = True


class Lit(NamedTuple):
    """The lights by environment, where the eye is, and of what the mesh is made."""

    lights: dict[str, Float[Array, "3 k"]]
    eye: Float[Array, " 3"]
    material: transfer.Material


@experiment("sloan2003.compression")
def compression(config: Compression, context: Context) -> list[Table]:
    lights = {
        name: sphere.project_lat_long(context.data.environment(name), config.degree)
        for name in config.environments or context.data.environments()
    }
    subjects = []
    for name in context.progress(config.meshes or context.data.meshes()[:1], "meshes"):
        subject = load(context, name, config.degree, directions=config.directions)
        subjects.append(subject.about)
        box = subject.box
        eye = subject.centroid + 2 * jnp.max(box[1] - box[0]) * jnp.asarray([0.3, -1.0, 0.3])
        material = transfer.Material(_ALBEDO, _ALBEDO, config.exponent)
        for row in _rows(config, subject, Lit(lights, eye, material)):
            context.record({"mesh": name} | row)
    _draw(context)
    about = {"about": "; ".join(subjects), "environments": ", ".join(lights)}
    return [Table("Error, bytes and time", values=about)]


def _forms(config: Compression, baked: transfer.Transfer) -> Iterator[Form]:
    def taken(make: Callable[[], Any]) -> tuple[Any, float]:
        start = time.perf_counter()
        made = jax.block_until_ready(make())
        return made, time.perf_counter() - start

    size = baked.coefficients.nbytes
    yield Form("all", baked, size, 0.0)
    half, seconds = taken(lambda: baked.astype(jnp.float16))
    yield Form("float16", half, size // 2, seconds)
    bits, seconds = taken(lambda: transfer.quantize(baked))
    # Places that fill up the last block do not count.
    yield Form("eight bits", bits, bits.num_points * bits.codes.shape[1], seconds, glossy=False)
    samples, seconds = taken(lambda: transfer.sample(baked))
    yield Form("samples", samples, samples.samples.nbytes + size, seconds)
    for clusters, components in config.sizes:
        small, seconds = taken(
            lambda clusters=clusters, components=components: transfer.compress(
                baked, clusters=clusters, components=components, progress=False
            )
        )
        yield Form(f"{clusters} × {components}", small, small.num_bytes, seconds)


def _rows(config: Compression, subject: Subject, lit: Lit) -> Iterator[dict[str, Any]]:
    forms = list(_forms(config, subject.baked))
    light = next(iter(lit.lights.values()))
    calls: dict[str, Callable[[], Array]] = {}
    for form in forms:
        calls[f"diffuse {form.name}"] = _diffuse(light, form)
        if form.glossy:
            calls[f"glossy {form.name}"] = _glossy(light, form, lit)
    times = interleaved(calls, rounds=config.rounds)
    exact = forms[0]
    for form in forms:
        row = {
            "form": form.name,
            "clustered": isinstance(form.transfer, transfer.CompressedTransfer),
            "vertices": form.transfer.num_points,
            "bytes": form.bytes / form.transfer.num_points,
            "smaller": exact.bytes / form.bytes,
            "make_seconds": form.seconds,
        }
        for kind, shade in (("diffuse", _diffuse), ("glossy", _glossy)):
            if kind == "glossy" and not form.glossy:
                continue
            more = (lit,) if kind == "glossy" else ()
            errors = [
                _errors(shade(light, form, *more)(), shade(light, exact, *more)())
                for light in lit.lights.values()
            ]
            spent = times[f"{kind} {form.name}"]
            row |= {
                f"{kind}_error": float(np.mean([rms for rms, _ in errors])),
                f"{kind}_worst": max(worst for _, worst in errors),
                f"{kind}_ms": spent.median_ms,
                f"{kind}_faster": ratio(times[f"{kind} {exact.name}"], spent),
            }
        yield row


def _diffuse(light: Float[Array, "3 k"], form: Form) -> Callable[[], Array]:
    return lambda: transfer.shade_diffuse(light, form.transfer, _ALBEDO)


def _glossy(light: Float[Array, "3 k"], form: Form, lit: Lit) -> Callable[[], Array]:
    return lambda: transfer.shade_glossy(light, form.transfer, lit.eye, lit.material)


def _errors(got: Array, exact: Array) -> tuple[float, float]:
    """Relative RMS error, and the largest error of a vertex over the largest color, in %."""
    off = np.asarray(got, np.float64) - np.asarray(exact, np.float64)
    rms = np.linalg.norm(off) / np.linalg.norm(np.asarray(exact, np.float64))
    return 100 * float(rms), 100 * float(np.abs(off).max() / np.abs(np.asarray(exact)).max())


def _draw(context: Context) -> None:
    figure, axes = plt.subplots(figsize=(6, 4), layout="constrained")
    for mesh in dict.fromkeys(row["mesh"] for row in context.rows):
        rows = [row for row in context.rows if row["mesh"] == mesh]
        clustered = [row for row in rows if row["clustered"]]
        others = [row for row in rows if row["form"] in ("float16", "eight bits")]
        (line,) = axes.plot(*_places(clustered), "o-", label=f"{mesh}, clusters × components")
        axes.plot(*_places(others), "s", color=line.get_color(), fillstyle="none")
        for row in clustered + others:
            place = row["bytes"], row["diffuse_error"]
            axes.annotate(row["form"], place, (4, 4), textcoords="offset points", fontsize=8)
    axes.set(xscale="log", yscale="log", xlabel="bytes a vertex", ylabel="error, %")
    axes.margins(0.15)
    plain_numbers(axes.xaxis)
    plain_numbers(axes.yaxis)
    axes.legend()
    axes.grid(alpha=0.3)
    save(figure, context.path("bytes.png", _BYTES))


def _places(rows: list[dict[str, Any]]) -> tuple[list[float], list[float]]:
    return [row["bytes"] for row in rows], [row["diffuse_error"] for row in rows]
