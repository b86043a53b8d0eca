"""A lat-long picture to coefficients and back, beside ducc0 and the basis times the picture."""

import functools
from collections.abc import Callable, Iterator
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from matplotlib.figure import Figure

from experiments.runner import Column
from experiments.shared.timing import Timing, interleaved, ratio
from jaxsh import sphere

from . import page
from ._sections import Cores, Rows, Section

HEIGHTS = (256, 512, 1024)
DEGREES = (4, 10, 30)
CORES = {"one": "one core", "all": "all cores"}
# Where the sum over all pixels' basis is timed too: larger ones take a minute.
_GENERIC = (256, 10)


def timings(cores: Cores, rounds: int, dtype: str) -> Iterator[dict[str, Any]]:
    """Rows of each picture and degree, RGB in float32."""
    threads = 1 if cores == "one" else 0  # 0: all
    for height in HEIGHTS:
        for degree in DEGREES:
            yield from _timings(degree, height, rounds, threads)


def _timings(degree: int, height: int, rounds: int, threads: int) -> Iterator[dict[str, Any]]:
    width = 2 * height
    generator = np.random.default_rng(0)
    light = jnp.asarray(generator.normal(size=(3, (degree + 1) ** 2)), jnp.float32)
    image = sphere.reconstruct_lat_long(light, height, width)
    peers = _Ducc(np.asarray(image), degree, threads)
    peers.check(np.asarray(light))

    def project(image):
        return sphere.project_lat_long(image, degree)

    def reconstruct(light):
        return sphere.reconstruct_lat_long(light, height, width)

    def gradient(pull, image):
        return jax.vjp(project, image)[1](pull)

    plain = np.asarray(image)
    reads = {"NumPy": plain.sum, "XLA": functools.partial(jax.jit(jnp.sum), image)}
    for quantity, ours, others in [
        ("project", functools.partial(jax.jit(project), image), peers.analyses()),
        ("reconstruct", functools.partial(jax.jit(reconstruct), light), peers.syntheses()),
        ("project, reverse", functools.partial(jax.jit(gradient), light, image), {}),
    ]:
        generic = {}
        if (height, degree) == _GENERIC and others:
            generic = _generic(quantity, image, light, degree)
        times = interleaved({"ours": ours} | others | reads | generic, rounds=rounds)
        yield {
            "quantity": quantity,
            "picture": f"{width}×{height}×3",
            "degree": degree,
            "ours_ms": times["ours"].median_ms,
            "ducc": _fastest(times, others) if others else None,
            "reads": 1 / _fastest(times, reads),
            "streamed": ratio(times["streamed"], times["ours"]) if generic else None,
            "sphericart": ratio(times["sphericart"], times["ours"]) if generic else None,
            "compile_s": times["ours"].first_seconds,
        }


def _fastest(times: dict[str, Timing], names) -> float:
    return min(ratio(times[name], times["ours"]) for name in names)


class _Ducc:
    """ducc0 on pictures in planes, as it likes them, with equal rows of Fejér's first rule."""

    def __init__(self, image: np.ndarray, degree: int, threads: int):
        self.planes = np.ascontiguousarray(np.moveaxis(image, -1, 0))[:, None]
        half = np.pi / image.shape[1]  # our pixels are at their middles
        self.common = {"spin": 0, "lmax": degree, "geometry": "F1", "phi0": half}
        self.common["nthreads"] = threads

    def analyses(self) -> dict[str, Callable[[], Any]]:
        """Its exact one, and the transpose of its synthesis, without weights yet."""
        from ducc0 import sht

        def each(function):
            return lambda: [function(map=plane, **self.common) for plane in self.planes]

        return {"analysis": each(sht.analysis_2d), "adjoint": each(sht.adjoint_synthesis_2d)}

    def syntheses(self) -> dict[str, Callable[[], Any]]:
        from ducc0 import sht

        found = self.analyses()["analysis"]()
        size = dict(zip(("ntheta", "nphi"), self.planes.shape[-2:], strict=True))
        return {
            "synthesis": lambda: [sht.synthesis_2d(alm=alm, **size, **self.common) for alm in found]
        }

    def check(self, light: np.ndarray) -> None:
        """That it finds the light of which the picture is made."""
        degree = self.common["lmax"]
        found = np.stack(self.analyses()["analysis"]())[:, 0]
        l, m = np.array([(l, m) for m in range(degree + 1) for l in range(m, degree + 1)]).T
        scale = np.where(m > 0, np.sqrt(2) * (-1.0) ** m, 1)  # its phase is Condon and Shortley's
        cosines, sines = scale * np.real(found), -(scale * np.imag(found))[:, m > 0]
        np.testing.assert_allclose(cosines, light[:, l * (l + 1) + m], rtol=0, atol=1e-3)
        ours = light[:, (l * (l + 1) - m)[m > 0]]
        np.testing.assert_allclose(sines, ours, rtol=0, atol=1e-3)


def _generic(quantity: str, image, light, degree: int) -> dict[str, Callable[[], Any]]:
    """The basis at every pixel times the picture."""
    from . import _peers

    quadrature = sphere.lat_long(*image.shape[:2])
    directions = jnp.asarray(quadrature.directions, jnp.float32)
    weights = jnp.asarray(quadrature.weights, jnp.float32)

    def peer_project(image):
        basis = _peers.sphericart_values(directions, degree)
        return (image.reshape(-1, 3) * weights[:, None]).T @ basis

    def peer_reconstruct(light):
        return (light @ _peers.sphericart_values(directions, degree).T).T.reshape(image.shape)

    if quantity == "project":
        streamed = jax.jit(lambda i: sphere.project(i.reshape(-1, 3).T, quadrature, degree))
        return {
            "streamed": functools.partial(streamed, image),
            "sphericart": functools.partial(jax.jit(peer_project), image),
        }
    streamed = jax.jit(lambda c: sphere.reconstruct(c, directions))
    return {
        "streamed": functools.partial(streamed, light),
        "sphericart": functools.partial(jax.jit(peer_reconstruct), light),
    }


def draw(figure: Figure, rows: Rows) -> None:
    """Plot ducc0's time over ours, by picture and degree."""
    panels = figure.subplots(1, 2, sharey=True)
    pictures = list(dict.fromkeys(row["picture"] for row in rows))
    colors = dict(zip(DEGREES, ("#56B4E9", "#0072B2", "#003355"), strict=True))
    for axes, quantity in zip(panels, ("project", "reconstruct"), strict=True):
        axes.axhline(1, color="0.4", lw=1)
        for i, (degree, color) in enumerate(colors.items()):
            for j, (cores, hatch) in enumerate({"one": None, "all": "///"}.items()):
                wanted = {"quantity": quantity, "degree": degree, "cores": cores}
                some = [row for row in page.matching(rows, **wanted) if row.get("ducc")]
                places = [pictures.index(row["picture"]) + (2 * i + j - 2.5) * 0.13 for row in some]
                label = f"degree {degree}, {CORES[cores]}" if quantity == "project" else None
                style = {"color": color, "hatch": hatch, "edgecolor": "white", "label": label}
                axes.bar(places, [row["ducc"] for row in some], 0.12, **style)
        axes.set(title=quantity, yscale="log", ylim=(0.7, 16))
        axes.set_xticks(range(len(pictures)), pictures)
        axes.set_yticks([1, 2, 4, 8, 16], ["1", "2×", "4×", "8×", "16×"])
        axes.minorticks_off()
        axes.grid(axis="y", alpha=0.3)
    panels[0].set_ylabel("time of ducc0 over jaxsh's")
    figure.legend(loc="outside lower center", ncols=3, frameon=False)


SECTION = Section(
    name="lat_long",
    title="Lat-long pictures",
    intro="To coefficients and back, RGB in float32, by separable sums; the others in times of "
    "these: ducc0, whose kernels are in C++, on its own layout of planes (the faster of "
    "`analysis_2d` and `adjoint_synthesis_2d`, or `synthesis_2d`, Fejér's rows), and, for one "
    "picture, the basis of all pixels times the picture.",
    columns=[
        Column("quantity", "quantity"),
        Column("picture", "picture"),
        Column("degree", "degree"),
        Column("ours_ms", "separable, ms", digits=2),
        Column("ducc", "ducc0 / separable", digits=1),
        Column("reads", "separable / reading once", digits=1),
        Column("streamed", "streamed / separable", digits=1),
        Column("sphericart", "sphericart + matmul / separable", digits=1),
        Column("compile_s", "first call, s", digits=2),
    ],
    timings=timings,
    draw=draw,
    note="Reading once: the sum of the picture's numbers, the faster of NumPy's and XLA's.",
    peers=("ducc0", "sphericart-jax"),
)
