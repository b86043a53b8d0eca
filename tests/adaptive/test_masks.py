"""The paper's filter, as masks and compacted, against its appendix followed line by line."""

import appendix
import jax
import jax.numpy as jnp
import numpy as np
import pytest
from jax.test_util import check_grads

from jaxsh import harmonics
from jaxsh.adaptive import Levels, Masks, _filter, shade
from jaxsh.transfer import Material, Transfer, shade_glossy

V, TARGET = 40, 4
EYE = np.array([0.5, -3.0, 2.0])


def strip(rng, dtype="float64", count=V, degree=TARGET):
    """Vertices in a row: each one's neighbors are the one before and the one behind."""
    decay = 1 / (1 + harmonics.degrees(degree)) ** 2
    rows = np.arange(count)[:, None]
    normals = rng.normal(size=(count, 3))
    return Transfer(
        jnp.asarray(rng.normal(size=(count, (degree + 1) ** 2)) * decay, dtype),
        jnp.asarray(rng.normal(size=(count, 3)), dtype),
        jnp.asarray(normals / np.linalg.norm(normals, axis=1, keepdims=True), dtype),
        jnp.asarray(np.clip(rows + np.array([-1, 1]), 0, count - 1), jnp.int32),
    )


def scene(rng, dtype="float64"):
    made = strip(rng, dtype)
    light = jnp.asarray(rng.normal(size=(3, (TARGET + 1) ** 2)), dtype)
    diffuse, specular = rng.uniform(0.2, 1, size=(2, V, 3)).astype(dtype)
    return light, made, EYE, Material(diffuse, specular, np.linspace(4, 40, V).astype(dtype))


# The two programs that most tests share: each reading of algorithm 1, one of them refined.
REFINED = {"fallback": "level", "rings": 3}
PLAIN = {"fallback": "base", "rings": 0}
METHODS = pytest.mark.parametrize("method", [Masks, Levels])


def twin(light, made, eye, material, *, base, thresholds, fallback, exposure, rings):
    """Color, degrees reached and shares kept, from the appendix."""
    light, transfer = np.asarray(light, np.float64), np.asarray(made.coefficients, np.float64)
    matrix = np.asarray(harmonics.product_matrix(light))
    towards = eye - np.asarray(made.positions)
    towards /= np.linalg.norm(towards, axis=1, keepdims=True)
    normal = np.asarray(made.normals)
    axis = 2 * np.sum(towards * normal, axis=1, keepdims=True) * normal - towards
    alpha = harmonics.convolve(
        np.ones((V, light.shape[1])),
        harmonics.phong(np.asarray(material.exponent), TARGET, normalized=True),
    )
    kernel = np.asarray(alpha * harmonics.evaluate(axis, TARGET))
    computes = {
        "diffuse": lambda v: lambda l: appendix.compute_diffuse(l, light, transfer[v]),
        "specular": lambda v: (
            lambda l: appendix.compute_specular(l, matrix, kernel[v], transfer[v])
        ),
    }
    albedos = {
        "diffuse": np.asarray(material.diffuse) / np.pi,
        "specular": np.asarray(material.specular),
    }
    color, reached, kept = np.zeros((V, 3)), {}, {}
    for kind, albedo in albedos.items():
        shown, degrees, stayed = zip(
            *[
                appendix.multi_level_filtering(
                    computes[kind](v),
                    exposure * albedo[v],
                    base,
                    TARGET,
                    thresholds[kind],
                    fallback,
                )
                for v in range(V)
            ],
            strict=True,
        )
        shown, degrees = np.array(shown), np.array(degrees)

        def full(v, kind=kind):
            return sum(computes[kind](v)(level) for level in range(base + 1, TARGET + 1))

        def joins(v, kind=kind, albedo=albedo):
            return np.abs(exposure * albedo[v] * full(v, kind)).max() >= thresholds[kind]

        inside = {v for v in range(V) if TARGET in stayed[v]}
        for v in appendix.refine_roi(inside, np.asarray(made.neighbors), joins, rings) - inside:
            shown[v] = sum(computes[kind](v)(level) for level in range(TARGET + 1))
            degrees[v] = TARGET
        color += albedo * shown
        reached[kind] = degrees
        kept[kind] = [np.mean([l in s for s in stayed]) for l in range(base + 1, TARGET + 1)]
    return color, reached, kept


@pytest.mark.parametrize(
    "options", [pytest.param(REFINED, marks=pytest.mark.slow), PLAIN], ids=["refined", "plain"]
)
def test_masks_follow_the_appendix(rng, options):
    inputs = scene(rng)
    thresholds = {"diffuse": 0.12, "specular": 0.15}
    color, reached, kept = twin(*inputs, base=2, thresholds=thresholds, exposure=1.3, **options)
    options = {"threshold": 0.15, "diffuse_threshold": 0.12, "exposure": 1.3} | options
    masks = shade(*inputs, Masks(**options))
    levels = shade(*inputs, Levels(**options))
    for kind in ("diffuse", "specular"):
        assert 0 < kept[kind][-1] <= kept[kind][0] < 1
        np.testing.assert_allclose(masks.active_fraction[kind], kept[kind], rtol=1e-12)
        np.testing.assert_array_equal(masks.shown_degree[kind], reached[kind])
    np.testing.assert_allclose(masks.color, color, rtol=0, atol=1e-12)
    np.testing.assert_allclose(levels.color, masks.color, rtol=0, atol=1e-13)
    assert jax.tree.all(
        jax.tree.map(
            np.array_equal,
            (levels.active_fraction, levels.shown_degree),
            (masks.active_fraction, masks.shown_degree),
        )
    )
    assert masks.relative_cost == pytest.approx(1)
    assert 0 < levels.relative_cost < 1


@METHODS
def test_thresholds_at_their_ends_and_a_base_that_is_all(rng, method):
    inputs = scene(rng)
    full = shade_glossy(*inputs)

    def filtered(**options):
        return shade(*inputs, method(**options))

    everyone = filtered(threshold=0.0, diffuse_threshold=0.0, **REFINED)
    nobody = filtered(threshold=np.inf, diffuse_threshold=np.inf, **PLAIN)
    np.testing.assert_allclose(everyone.color, full, rtol=0, atol=1e-12)
    assert all((kept == 1).all() for kept in everyone.active_fraction.values())
    assert all((kept == 0).all() for kept in nobody.active_fraction.values())
    assert all((reached == 2).all() for reached in nobody.shown_degree.values())
    never = {"diffuse": np.inf, "specular": np.inf}
    base, *_ = twin(*inputs, base=2, thresholds=never, exposure=1.0, **PLAIN)
    np.testing.assert_allclose(nobody.color, base, rtol=0, atol=1e-12)
    np.testing.assert_allclose(filtered(base=TARGET).color, full, rtol=0, atol=1e-12)


def test_filtering_in_float32(rng):
    inputs = scene(rng, "float32")
    result = shade(*inputs, Levels(threshold=0.0, diffuse_threshold=0.0, **PLAIN))
    assert result.color.dtype == result.relative_cost.dtype == np.float32
    np.testing.assert_allclose(result.color, shade_glossy(*inputs), rtol=0, atol=3e-6)


def test_the_boundary_is_smoothed_as_in_figure_7(rng):
    light, made, eye, material = scene(rng)
    # The glossy part alone at an albedo of one shows what the region adds.
    white = Material(0 * material.diffuse, 0 * material.specular + 1, material.exponent)
    inputs, options = (light, made, eye, white), {"threshold": 0.5, **PLAIN}
    base = shade(*inputs, Masks(**options | {"threshold": np.inf})).color
    sharp = shade(*inputs, Masks(**options))
    smooth = shade(*inputs, Masks(smoothing=True, **options))
    region = np.flatnonzero(sharp.shown_degree["specular"] == TARGET)
    # A vertex that left below the target is outside: smoothing replaces what it had kept.
    near = np.asarray(made.neighbors)
    expected = appendix.smooth_boundary(np.asarray(sharp.color - base), region, near)
    assert 0 < np.count_nonzero((expected != sharp.color - base).any(axis=1)) < V
    np.testing.assert_allclose(smooth.color - base, expected, rtol=0, atol=1e-12)
    assert jax.tree.all(jax.tree.map(np.array_equal, sharp.shown_degree, smooth.shown_degree))


def test_hysteresis_holds_whom_the_last_frame_held(rng):
    inputs = scene(rng)

    def at(threshold, **options):
        limits = {"threshold": threshold, "diffuse_threshold": threshold}
        return shade(*inputs, Masks(**limits, **PLAIN, **options))

    low, high = at(0.1), at(0.2)
    assert float(high.active_fraction["specular"][-1]) < float(low.active_fraction["specular"][-1])
    # Those that the last frame let go come back at the threshold alone.
    for previous, hysteresis, expected in ((low, 0.5, low), (low, 1.0, high), (high, 0.5, high)):
        held = at(0.2, previous=previous, hysteresis=hysteresis)
        for kind in held.active_fraction:
            np.testing.assert_array_equal(
                held.active_fraction[kind], expected.active_fraction[kind]
            )
            np.testing.assert_array_equal(held.shown_degree[kind], expected.shown_degree[kind])


@pytest.mark.slow
def test_filtered_derivatives(rng):
    light, made, eye, material = scene(rng)

    def color(light, specular):
        changed = Material(material.diffuse, specular, material.exponent)
        limits = {"threshold": 0.15, "diffuse_threshold": 0.12}
        return shade(light, made, eye, changed, Levels(**limits, **PLAIN)).color

    arguments = light, material.specular
    check_grads(color, arguments, order=1, modes=["fwd", "rev"], rtol=1e-6, atol=1e-6)


def test_a_region_of_another_size_is_no_other_program(rng):
    inputs = scene(rng)
    shade(*inputs, Levels(**PLAIN))
    before = _filter.filtered._cache_size()
    spent = [
        float(shade(*inputs, Levels(threshold=threshold, **PLAIN)).relative_cost)
        for threshold in (0.0, 0.1, 0.3, 10.0)
    ]
    assert _filter.filtered._cache_size() == before
    assert spent == sorted(spent, reverse=True)
    assert spent[0] > spent[1] > spent[-1]


def test_levels_map_over_lights(rng):
    light, *others = scene(rng)
    lights = jnp.stack([light, 2 * light])
    mapped = jax.vmap(lambda light: shade(light, *others, Levels(**PLAIN)).color)(lights)
    alone = jnp.stack([shade(light, *others, Levels(**PLAIN)).color for light in lights])
    np.testing.assert_allclose(mapped, alone, rtol=1e-12, atol=1e-13)


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"base": 5}, "base from 0 to the light's degree, 4, got 5"),
        ({"rings": -1}, "rings must be an integer >= 0, got -1"),
        ({"fallback": "middle"}, "fallback must be one of .* got 'middle'"),
        ({"fallback": "bas"}, "did you mean 'base'"),
        ({"threshold": -1.0}, "threshold must be >= 0, got -1"),
        ({"threshold": np.ones(3)}, r"threshold as a number, got shape \(3,\)"),
    ],
)
def test_bad_filter_options_are_refused(unchecked, rng, options, message):
    with pytest.raises(ValueError, match=message):
        shade(*scene(rng), Masks(**options))
