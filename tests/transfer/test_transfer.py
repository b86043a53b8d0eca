"""What a transfer says of its points, in every form, and what refuses those of a volume."""

import dataclasses

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from jaxsh import adaptive, geometry, inverse, midrange, sphere, transfer

MESH = geometry.knot(300)
MADE = transfer.unshadowed(MESH.vertices, MESH.normals, 2)
VOLUME = dataclasses.replace(
    MADE, surface="points", cosine=False, normals=jnp.zeros_like(MADE.normals)
)


def kind(made):
    return made.surface, made.cosine


def test_each_form_says_what_its_points_are():
    assert kind(MADE) == ("vertices", True)
    texels = dataclasses.replace(MADE, surface="texels")
    one = jax.devices()[:1]
    for form in (
        texels.truncated(1),
        texels.astype(np.float16),
        texels.sharded(one),
        transfer.sample(texels, 1).sharded(one),
        transfer.quantize(texels).sharded(one),
        jax.tree.map(lambda array: array, texels),
    ):
        assert kind(form) == ("texels", True), type(form)
    assert kind(transfer.quantize(VOLUME)) == ("points", False)
    staged = adaptive.stage(dataclasses.replace(MADE, surface="points"), 1, middle=1, base=1)
    assert kind(staged) == ("points", True)


def test_other_kinds_are_refused(unchecked):
    with pytest.raises(ValueError, match="surface must be one of vertices, points, texels, got"):
        dataclasses.replace(MADE, surface="pixels")
    with pytest.raises(ValueError, match="cosine must be True or False, got 1"):
        dataclasses.replace(MADE, cosine=1)


LIGHT, EYE = jnp.ones((3, 9), jnp.float32), jnp.ones(3, jnp.float32)
SUNS = sphere.Suns(EYE[None], jnp.ones(1, jnp.float32), jnp.ones((1, 3), jnp.float32))
GLOSSY = transfer.Material(0.5, 0.5, 8.0)


@pytest.mark.parametrize(
    "shade",
    [
        lambda made: transfer.shade_diffuse(LIGHT, made, 0.5),
        lambda made: transfer.shade_diffuse(LIGHT, transfer.quantize(made), 0.5),
        lambda made: transfer.shade_glossy(LIGHT, made, EYE, GLOSSY),
        lambda made: transfer.shade_glossy(LIGHT, transfer.sample(made), EYE, GLOSSY),
        lambda made: transfer.fixed_light(LIGHT, made),
        lambda made: transfer.fixed_view(made, EYE, GLOSSY),
        lambda made: transfer.sun_visibility(SUNS, made, rays=1),
        lambda made: adaptive.shade(LIGHT, made, EYE, GLOSSY, "levels"),
        adaptive.stage,
        lambda made: inverse.fit_light(jnp.ones((300, 3), jnp.float32), made, 0.5, 2),
        lambda made: midrange.shade(
            midrange.make_expansion(EYE, jnp.ones((3, 9)), jnp.ones((3, 9, 3))), made, 0.5
        ),
    ],
)
def test_shading_a_volume_as_a_surface_is_refused(unchecked, shade):
    with pytest.raises(ValueError, match="with the cosine of a surface, got that of points with"):
        shade(VOLUME)


@pytest.mark.parametrize(
    "method", [adaptive.Levels(rings=1), adaptive.TwoStage(smoothing=True, base=1)]
)
def test_methods_that_look_at_neighbors_refuse_points(method):
    points = dataclasses.replace(MADE, surface="points")
    with pytest.raises(ValueError, match="looks at neighbors, which points do not have"):
        adaptive.shade(LIGHT, points, EYE, GLOSSY, method)


def test_fluence_is_the_product_of_coefficients(rng):
    lights = jnp.asarray(rng.normal(size=(2, 300, 3, 9)), jnp.float32)
    # Measured: 5e-7, and 0.014 in eight bits.
    got = transfer.fluence(lights, VOLUME)
    expected = np.einsum("bvck,vk->bvc", *map(np.float64, (lights, VOLUME.coefficients)))
    np.testing.assert_allclose(got, expected, rtol=0, atol=1e-6)
    shared = transfer.fluence(lights[:, :1], VOLUME)
    np.testing.assert_allclose(shared[0], transfer.fluence(lights[0, 0], VOLUME), rtol=0, atol=1e-6)
    np.testing.assert_allclose(
        shared, np.einsum("bck,vk->bvc", lights[:, 0], VOLUME.coefficients), rtol=0, atol=1e-6
    )
    eights = transfer.fluence(lights[0, 0], transfer.quantize(VOLUME))
    np.testing.assert_allclose(eights, shared[0], rtol=0, atol=0.02)
    with pytest.raises(ValueError, match="points without normals, got one with the cosine"):
        transfer.fluence(lights, MADE)


def test_a_transfer_belongs_to_its_surface():
    assert MADE.belongs_to(MESH)
    assert MADE.sharded(jax.devices()).belongs_to(MESH)
    assert MADE.astype(np.float16).belongs_to(MESH)
    assert not VOLUME.belongs_to(MESH)
    assert not MADE.belongs_to(geometry.knot(400))
    assert not jax.tree.map(lambda rows: jnp.concatenate([rows, rows[:1]]), MADE).belongs_to(MESH)
    for changed in ("vertices", "normals"):
        other = dataclasses.replace(MESH, **{changed: getattr(MESH, changed).at[7, 0].add(1e-3)})
        assert not MADE.belongs_to(other)

    @jax.jit
    def traced(made, mesh):
        return jnp.asarray(made.belongs_to(mesh))

    assert traced(MADE, geometry.knot(300))
    assert not traced(MADE, geometry.knot(400))
