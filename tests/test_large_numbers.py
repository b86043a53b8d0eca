"""Numbers that a float32 does not hold are refused, where they would be infinite in a picture."""

import math

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from jaxsh import geometry, imaging, midrange, transfer

_HUGE = [1e300, 10**300, 10**400, 10**5000]


@pytest.fixture(scope="module")
def baked():
    points = np.eye(3, dtype=np.float32)
    with jax.enable_x64(False):
        return transfer.unshadowed(points, points, 1)


@pytest.mark.parametrize("x64", [False, True])
@pytest.mark.parametrize("number", _HUGE, ids=["1e300", "10**300", "10**400", "10**5000"])
def test_numbers(number, x64, baked, unchecked):
    light, points = np.ones((3, 4), np.float32), baked.positions
    with jax.enable_x64(x64):
        for call in (
            lambda: transfer.shade_diffuse(light, baked, number),
            lambda: imaging.auto_exposure(light, percentile=number),
            lambda: midrange.inverse_distance_weights(points, points, exponent=number),
        ):
            with pytest.raises(ValueError, match=r"(albedo|percentile|exponent) must be"):
                call()
        if not x64 or number > 1e300:
            with pytest.raises(ValueError, match=r"diffuse must be finite"):
                transfer.Material(number, 0.0, 1.0)


def test_arrays_that_are_cast(baked, unchecked):
    light = np.ones((3, 4))
    light[1, 2] = 1e300
    said = r"light must be finite in float32, got 1e\+300 in 1 of 12 places"
    for x64, given in ((False, light), (False, light.tolist()), (True, light)):
        with jax.enable_x64(x64), pytest.raises(ValueError, match=said):
            transfer.shade_diffuse(given, baked, 0.5)
    with jax.enable_x64(True):
        with pytest.raises(ValueError, match=said):
            transfer.shade_diffuse(jnp.asarray(light), baked, 0.5)
        material = transfer.Material(0.5, 1e300, 4.0)
        with pytest.raises(ValueError, match=r"specular of the material must be finite in float32"):
            transfer.shade_glossy(light * 0, baked, np.ones(3), material)
    with (
        jax.enable_x64(False),
        pytest.raises(ValueError, match="positions must be finite in float"),
    ):
        geometry.Points(np.full((2, 3), 1e300))


def test_large_integers_are_numbers():
    """JAX's own integers end at 2³¹ without x64."""
    with jax.enable_x64(False):
        material = transfer.Material(10**12, 0, 1)
    assert material.diffuse.dtype == jnp.float32
    assert math.isclose(material.diffuse, 1e12, rel_tol=6e-8)
