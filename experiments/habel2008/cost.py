"""What the sky's coefficients cost: bytes, and time for one sun and for many.

Against what one would do without a fit: sum over samples of the sky. And against NumPy, which
has no dispatch to pay for.
"""

import dataclasses
import functools
import math
from collections.abc import Callable, Iterator
from importlib.resources import as_file, files
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from jaxsh import harmonics, sky, sphere

from ..runner import Context, Table, experiment
from ..shared.timing import fastest, timed
from .numpy_twin import polynomial, projection
from .suns import PLAIN, TURBIDITY, ZENITH, Suns, polynomials, project

SAMPLES = 4096
_DEGREE = 6
_PAPER_MICROSECONDS = 80.0  # "maximum computation time for 7 bands", on a Pentium 4 of 3.2 GHz


@dataclasses.dataclass(frozen=True)
class Cost:
    suns: int = 10_000
    """suns of a batch"""
    sampled: int = 64
    """suns of a batch where the sky is sampled, which takes long"""
    rounds: int = 5
    """rounds in which all take turns; the fastest counts"""

    def __post_init__(self):
        if min(self.suns, self.sampled, self.rounds) < 1:
            raise ValueError("suns, sampled and rounds must be at least 1")


class Batch(NamedTuple):
    """Suns and turbidities drawn at random, float32: in the paper's ranges, any azimuth."""

    sun: Float[np.ndarray, "n 3"]
    turbidity: Float[np.ndarray, " n"]

    @classmethod
    def draw(cls, count: int, seed: int) -> "Batch":
        random = np.random.default_rng(seed)
        theta = random.uniform(ZENITH.low, ZENITH.high, count)
        phi = random.uniform(-np.pi, np.pi, count)
        ring = np.sin(theta)
        sun = np.stack([ring * np.cos(phi), ring * np.sin(phi), np.cos(theta)], axis=-1)
        turbidity = random.uniform(TURBIDITY.low, TURBIDITY.high, count)
        return cls(sun.astype(np.float32), turbidity.astype(np.float32))

    def first(self, count: int) -> "Batch":
        return Batch(self.sun[:count], self.turbidity[:count])

    @property
    def angles(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        x, y, z = self.sun.astype(np.float64).T
        turbidity = self.turbidity.astype(np.float64)
        return np.arctan2(np.hypot(x, y), z), np.arctan2(y, x), turbidity


class Way(NamedTuple):
    """One way to the coefficients: for one sun and for a batch, both (n, 3, K)."""

    family: str
    one: Callable[[], Any]
    many: Callable[[], Any]
    suns: int  # of `many`


@experiment("habel2008.cost")
def cost(config: Cost, context: Context) -> list[Table]:
    batch = Batch.draw(max(config.suns, config.sampled), context.seed)
    ways = _ways(config, context, batch)
    for way in ways.values():
        way.many()  # warm
    singles = fastest({name: way.one for name, way in ways.items()}, rounds=config.rounds)
    batches = fastest({name: way.many for name, way in ways.items()}, rounds=config.rounds)
    judged = batch.first(min(config.suns, config.sampled, 256))
    exact, low = _exact(judged)
    for name, way in ways.items():
        got = np.asarray(way.many(), np.float64)[: len(judged.sun)]
        norm = np.linalg.norm(got - exact, axis=-1)
        row = {
            "way": name,
            "family": way.family,
            "one_us": 1e6 * singles[name],
            "per_sun_us": 1e6 * batches[name] / way.suns,
            "suns": way.suns,
            "error": 100 * float(np.max(norm / low)),
            "relative": 100 * float(np.max(norm / np.linalg.norm(exact, axis=-1))),
        }
        context.record(row | ({"one_us_paper": _PAPER_MICROSECONDS} if "eq. 1" in name else {}))
    return [_memory(context), *_times(config, context.rows)]


def _ways(config: Cost, context: Context, batch: Batch) -> dict[str, Way]:
    many, few = batch.first(config.suns), batch.first(config.sampled)
    double, plain = _plain_fit()
    stored = sky.preetham_harmonics
    sampled, views, weight = _sampled()
    numpy_polynomial = polynomial(double)
    numpy_sampled = projection(views, weight, _DEGREE)
    angles, first = many.angles, batch.first(1).angles
    exact_suns = [(s.astype(np.float64), float(t)) for s, t in zip(*few, strict=True)]
    jitted = functools.partial(_jitted, context)
    one = batch.sun[0], batch.turbidity[0]
    return {
        "ours, jitted": Way("ours", *jitted("ours", stored, one, many), config.suns),
        "ours, called as it is": Way(
            "ours", lambda: stored(*one), lambda: stored(*many), config.suns
        ),
        "polynomials of eq. 1 in Chebyshev form, jitted": Way(
            "plain", *jitted("eq. 1", lambda *at: plain(*at), one, many), config.suns
        ),
        "eq. 1 in NumPy, float64": Way(
            "numpy",
            lambda: numpy_polynomial(*first),
            lambda: numpy_polynomial(*angles),
            config.suns,
        ),
        f"{SAMPLES:,} samples, jitted": Way(
            "samples", *jitted("samples", sampled, one, few), config.sampled
        ),
        f"{SAMPLES:,} samples in NumPy, float64": Way(
            "numpy samples",
            lambda: numpy_sampled(*exact_suns[0]),
            lambda: np.stack([numpy_sampled(*sun) for sun in exact_suns]),
            config.sampled,
        ),
    }


def _jitted(
    context: Context, label: str, function: Callable[..., Array], one, many
) -> tuple[Callable[[], Array], Callable[[], Array]]:
    """The compiled function bound to one sun and to many; compiling is recorded apart."""

    def bind(name: str, arrays) -> Callable[[], Array]:
        arguments = [jnp.asarray(a) for a in arrays]
        compiled, seconds = timed(lambda: jax.jit(function).lower(*arguments).compile())
        context.times[f"{label}: {name}"] = {"compile_seconds": seconds}
        return functools.partial(compiled, *arguments)

    return bind("one sun", one), bind("a batch", many)


def _plain_fit() -> tuple[sky.SkyFit, sky.SkyFit]:
    """The paper's plain polynomials, by least squares in float64: so, and rounded to float32."""
    nodes = Suns.nodes(*(2 * count for count in PLAIN))
    with jax.enable_x64(True):
        [samples] = project([nodes], _DEGREE + 1)
        along = [
            np.linalg.pinv(polynomials(axis, values, count))
            for axis, values, count in zip((ZENITH, TURBIDITY), nodes, PLAIN, strict=True)
        ]
    half = samples[..., harmonics.orders(_DEGREE) >= 0]
    values = np.einsum("in,jm,nmcr->crij", *along, half, optimize=True)

    def fit() -> sky.SkyFit:
        return sky.SkyFit(jnp.asarray(values), jnp.eye(3), (ZENITH, TURBIDITY), False)

    with jax.enable_x64(True):
        double = fit()
    return double, fit()


def _sampled() -> tuple[Callable[[Array, Array], Array], np.ndarray, float]:
    """Of the sky's hemisphere alone, on a spiral: the best that equal weights do."""
    spiral = sphere.fibonacci(2 * SAMPLES)
    views = np.asarray(spiral.directions)
    views = views[views[:, 2] > 0]
    weight = 2 * np.pi / len(views)
    basis = jnp.asarray(weight * np.asarray(harmonics.evaluate(views, _DEGREE)), views.dtype)

    def single(sun, turbidity):
        radiance = sky.preetham_radiance(views, sun, turbidity, check="allow")
        return jnp.matmul(radiance.T, basis, precision="highest")

    def each(sun, turbidity):
        if sun.ndim == 1:
            return single(sun, turbidity)
        return jax.lax.map(lambda row: single(*row), (sun, turbidity))

    return each, views, weight


def _exact(batch: Batch) -> tuple[np.ndarray, np.ndarray]:
    with jax.enable_x64(True):
        sun, turbidity = (jnp.asarray(a, jnp.float64) for a in batch)
        exact = np.asarray(sky.project_preetham(sun, turbidity, _DEGREE))
        return exact, np.asarray(sky.smallest_luminance(sun, turbidity))


def _memory(context: Context) -> Table:
    """Bytes, by formula for the paper's and by what is stored for ours."""
    doubles = math.prod(PLAIN) * 8
    rows: list[dict[str, Any]] = [
        {
            "what": "the paper's, 7 bands",
            "made of": "49 weights × 3 channels × 14 × 8 doubles",
            "bytes": 49 * 3 * doubles,
            "bytes_paper": 131_000,
        },
        {
            "what": "the paper's, 4 bands, as for 7",
            "made of": "16 weights × 3 channels × 14 × 8 doubles",
            "bytes": 16 * 3 * doubles,
            "bytes_paper": 28_000,
        },
        {
            "what": "the paper's, 4 bands, what gives its figure",
            "made of": "16 weights × 2 channels × 14 × 8 doubles",
            "bytes": 16 * 2 * doubles,
            "bytes_paper": 28_000,
        },
    ]
    for name, array in _stored().items():
        weights, *terms = array.shape[1:]
        dtype = {4: "floats", 8: "doubles"}[array.dtype.itemsize]
        for bands in (7, 4):
            count = bands * (bands + 1) // 2
            made = f"{count} weights (m ≥ 0) × 3 channels × {terms[0]} × {terms[1]} {dtype}"
            rows.append(
                {
                    "what": f'ours, table "{name}", {bands} bands',
                    "made of": made,
                    "bytes": array.nbytes * count // weights,
                }
            )
    for row in rows:
        context.record(row)

    return Table("Memory", rows=rows)


def _stored() -> dict[str, np.ndarray]:
    with as_file(files(sky) / "preetham.npz") as path, np.load(path) as stored:
        return {name: stored[name] for name in ("small", "precise", "wide")}


def _times(config: Cost, rows: list[dict[str, Any]]) -> Iterator[Table]:
    timed = [row for row in rows if "way" in row]

    yield Table("Time for 7 bands", rows=timed, values={"verdict": verdict(timed)})


def verdict(rows: list[dict[str, Any]]) -> str:
    """Who wins, in words, from the numbers."""
    by = {row["way"]: row for row in rows}
    ours, plain = by["ours, jitted"], by["eq. 1 in NumPy, float64"]
    said = []
    for key, what in (("one_us", "For one sun"), ("per_sun_us", "In a batch")):
        ratio = ours[key] / plain[key]
        winner = "NumPy wins" if ratio > 1 else "JAX wins"
        factor = max(ratio, 1 / ratio)
        said.append(
            f"{what} {winner}: ours takes {ours[key]:.3g} µs, NumPy {plain[key]:.3g}, "
            f"a factor of {factor:.2g}."
        )
    said.append(
        f"NumPy's polynomial is the paper's, with {plain['error'] / ours['error']:.0f} times the "
        "error of ours."
    )
    return " ".join(said)
