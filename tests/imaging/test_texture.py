"""Textures: looked up bilinear and mip-mapped."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from jax.test_util import check_grads

from jaxsh.imaging import sample_texture

WRAPS = (
    "repeat",
    pytest.param("clamp", marks=pytest.mark.slow),
    pytest.param("mirror", marks=pytest.mark.slow),
)


def texel(picture, i, j, wrap):
    """One texel, also beyond the edge: NumPy's own padding does the wrapping."""
    mode = {"repeat": "wrap", "clamp": "edge", "mirror": "symmetric"}[wrap]
    height, width, _ = picture.shape
    rows, columns = (np.pad(np.arange(n), 4 * n, mode=mode) for n in (height, width))
    return picture[rows[i + 4 * height], columns[j + 4 * width]]


def bilinear(picture, u, v, wrap):
    height, width, _ = picture.shape
    x, y = u * width - 0.5, (1 - v) * height - 0.5
    i, j = int(np.floor(y)), int(np.floor(x))
    s, t = x - j, y - i
    top = texel(picture, i, j, wrap) * (1 - s) + texel(picture, i, j + 1, wrap) * s
    bottom = texel(picture, i + 1, j, wrap) * (1 - s) + texel(picture, i + 1, j + 1, wrap) * s
    return top * (1 - t) + bottom * t


def shares(count):
    """How much of each new texel each old one covers, by the overlap of intervals."""
    half = max(count // 2, 1)
    new, old = np.linspace(0, 1, half + 1), np.linspace(0, 1, count + 1)
    low = np.maximum(new[:-1, None], old[None, :-1])
    high = np.minimum(new[1:, None], old[None, 1:])
    return np.clip(high - low, 0, None) * half


def levels(picture):
    found = [picture]
    while max(found[-1].shape[:2]) > 1:
        last = found[-1]
        found.append(np.einsum("ai,bj,ijc->abc", *map(shares, last.shape[:2]), last))
    return found


def trilinear(picture, u, v, footprint, wrap):
    height, width, _ = picture.shape
    steps = np.array([width, height])[:, None] * footprint
    level = np.log2(max(np.linalg.norm(steps, axis=0).max() / np.sqrt(3), 1))
    found = levels(picture)
    level = min(level, len(found) - 1)
    k = min(int(level), len(found) - 2)
    one, other = (bilinear(found[n], u, v, wrap) for n in (k, k + 1))
    return one + (other - one) * (level - k)


@pytest.mark.parametrize("wrap", WRAPS)
def test_look_up_is_the_slow_twin(rng, wrap):
    picture = rng.uniform(size=(5, 12, 2))
    uv = rng.uniform(-1.5, 2.5, size=(60, 2))
    uv[:4] = [[0, 0], [1, 1], [0.5, 1], [2, -1]]
    footprint = rng.normal(size=(60, 2, 2)) * np.geomspace(0.01, 2, 60)[:, None, None]
    found = sample_texture(jnp.asarray(picture), jnp.asarray(uv), wrap=wrap)
    twin = [bilinear(picture, u, v, wrap) for u, v in uv]
    np.testing.assert_allclose(found, twin, rtol=0, atol=1e-14)  # 2e-15 measured
    found = sample_texture(jnp.asarray(picture), jnp.asarray(uv), jnp.asarray(footprint), wrap=wrap)
    twin = [trilinear(picture, u, v, f, wrap) for (u, v), f in zip(uv, footprint, strict=True)]
    np.testing.assert_allclose(found, twin, rtol=0, atol=1e-14)


def test_texels_are_where_the_convention_says(rng):
    picture = jnp.asarray(rng.uniform(size=(3, 4, 2)))
    u, v = (np.arange(4) + 0.5) / 4, 1 - (np.arange(3) + 0.5) / 3
    uv = jnp.asarray(np.stack(np.meshgrid(u, v), axis=-1))
    np.testing.assert_allclose(sample_texture(picture, uv), picture, rtol=0, atol=1e-14)
    # A step of twice the picture gives its mean, wherever; one of a texel changes nothing.
    whole = jnp.broadcast_to(jnp.eye(2), (3, 4, 2, 2))
    mean = jnp.broadcast_to(picture.mean((0, 1)), (3, 4, 2))
    np.testing.assert_allclose(sample_texture(picture, uv, 2 * whole), mean, rtol=0, atol=1e-14)
    found = sample_texture(picture, uv, whole * jnp.array([[[[1 / 4, 1 / 3]]]]))
    np.testing.assert_allclose(found, picture, rtol=0, atol=1e-14)


@pytest.mark.slow
def test_a_fine_checkerboard_is_gray_from_far_and_itself_from_near():
    """What mip-mapping is for: without it, steps of odd texels see black and white in turn."""
    board = jnp.asarray(np.indices((64, 64)).sum(0) % 2, jnp.float32)[..., None]
    uv = jnp.asarray(np.stack(np.meshgrid(*2 * [(np.arange(12) * 5 + 0.5) / 64]), -1), jnp.float32)
    far = jnp.broadcast_to(jnp.eye(2, dtype=jnp.float32) * 5 / 64, (12, 12, 2, 2))
    np.testing.assert_allclose(sample_texture(board, uv, far), 0.5, rtol=0, atol=1e-6)
    assert float(jnp.std(sample_texture(board, uv))) > 0.49


@pytest.mark.slow
def test_sampling_differentiates(rng):
    picture = jnp.asarray(rng.uniform(size=(5, 6, 2)))
    uv = jnp.asarray(rng.uniform(-1, 2, size=(12, 2)))
    footprint = jnp.asarray(rng.normal(size=(12, 2, 2)) * 0.3)
    sample = jax.jit(lambda *a: sample_texture(*a, wrap="mirror"))
    check_grads(sample, (picture, uv, footprint), 1, ("fwd", "rev"), atol=1e-6, rtol=1e-6)
    # No step at all has no direction, and still a finite slope; constant pictures have none.
    slope = jax.grad(lambda f: sample(picture, uv, f).sum())(0 * footprint)
    np.testing.assert_array_equal(slope, 0)
    # Weights of each look-up sum to one.
    gradient = jax.grad(lambda p: sample(p, uv, footprint).sum())(picture)
    np.testing.assert_allclose(gradient.sum(), 24, rtol=1e-14)


@pytest.mark.slow
def test_dtypes_and_nan(rng):
    for dtype in (jnp.float32, jnp.float64):
        picture = jnp.asarray(rng.uniform(size=(4, 4, 3)), dtype)
        for other in (jnp.float32, jnp.float64):
            uv = jnp.asarray([[0.1, jnp.nan], [jnp.inf, 0.3]], other)
            found = sample_texture(picture, uv)
            assert found.dtype == dtype
            assert jnp.isnan(found).all()


def test_other_shapes_are_refused(unchecked):
    picture, uv = jnp.ones((4, 5, 3)), jnp.ones((6, 2))
    with pytest.raises(ValueError, match=r"expected uv \(..., 2\) .* got shape \(2, 6\)"):
        sample_texture(picture, uv.T)
    with pytest.raises(ValueError, match=r"expected footprint \(6, 2, 2\).* got shape \(6, 2\)"):
        sample_texture(picture, uv, uv)
    with pytest.raises(ValueError, match=r"in floats, got uint8.*srgb_decode"):
        sample_texture(picture.astype(jnp.uint8), uv)
    with pytest.raises(ValueError, match=r"wrap must be one of .* did you mean 'mirror'"):
        sample_texture(picture, uv, wrap="mirrored")
    with pytest.raises(ValueError, match="texture must be finite, got nan in 1 of 60"):
        sample_texture(picture.at[1, 2, 0].set(jnp.nan), uv)
