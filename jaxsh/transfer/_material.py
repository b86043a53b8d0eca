"""Surface materials, and the argument checks that all shading shares, made before tracing."""

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, ArrayLike, Float

from .._core.checks import as_finite, check_known, check_type, is_concrete
from .._core.devices import Devices, mesh_of, share, whole
from ..harmonics import degree_of


def _as_strong(name: str, least: float | None):
    """Converts to a type of its own, so that numbers and arrays run the same compiled programs."""

    def convert(value: ArrayLike) -> Float[Array, "..."]:
        array = as_finite(value, name, least=least, wait=True)
        return array.astype(array.dtype)

    return convert


class Material(eqx.Module):
    """Holds how a surface of V vertices reflects light: diffusely, and through a Phong lobe.

    `diffuse` and `specular` are albedos: a number, RGB (3,), or per vertex (V, 1) or (V, 3).
    `exponent` is that of the glossy lobe, a number or (V,). Differentiable in all three.

    The lobe integrates to one over the sphere, as in Lee & Kim, so that with the cosine less than
    `specular` of uniform light is reflected: `modified_phong` takes the share itself.

    Raises `ValueError` for other shapes, and where values are known and an albedo is not finite
    and >= 0, or an exponent not finite and above -1.

    **Example**

    >>> import jax.numpy as jnp
    >>> from jaxsh.transfer import Material
    >>> red = jnp.asarray([0.5, 0.1, 0.1])
    >>> plastic = Material(diffuse=red, specular=0.04, exponent=32.0)
    >>> plastic.diffuse.shape, plastic.exponent.shape
    ((3,), ())
    """

    diffuse: Float[Array, "..."] = eqx.field(converter=_as_strong("diffuse", 0.0))
    specular: Float[Array, "..."] = eqx.field(converter=_as_strong("specular", 0.0))
    exponent: Float[Array, "..."] = eqx.field(converter=_as_strong("exponent", None))

    def __check_init__(self):
        for name in ("diffuse", "specular"):
            array = getattr(self, name)
            if array.ndim > 2 or (
                array.ndim and array.shape[-1] not in ((3,), (1, 3))[array.ndim - 1]
            ):
                raise ValueError(
                    f"expected {name} as a number, (3,), (V, 1) or (V, 3), got shape {array.shape}"
                )
        if self.exponent.ndim > 1:
            raise ValueError(
                f"expected exponent as a number or (V,), got shape {self.exponent.shape}"
            )
        if is_concrete(self.exponent) and not (np.asarray(self.exponent) > -1).all():
            raise ValueError("exponent must be finite and above -1 everywhere")
        counts = {
            name: len(array)
            for name, array, ndim in (
                ("diffuse", self.diffuse, 2),
                ("specular", self.specular, 2),
                ("exponent", self.exponent, 1),
            )
            if array.ndim == ndim
        }
        if len(set(counts.values())) > 1:
            raise ValueError(f"a material is of one mesh, but its numbers of vertices are {counts}")

    @classmethod
    def modified_phong(
        cls,
        diffuse: Float[ArrayLike, "..."],
        specular: Float[ArrayLike, "..."],
        exponent: Float[ArrayLike, "..."],
    ) -> "Material":
        """Make a material whose lobe is normalized together with the cosine.

        The lobe is scaled by (k+2)/(k+1), to (k+2)/2π cosᵏα: of uniform light a surface that is
        seen along its normal reflects the share `specular`, aslant less, never more. Lafortune &
        Willems 1994, "Using the modified Phong reflectance model for physically based rendering".
        Arguments, errors and derivatives are those of `Material`.

        **Example**

        >>> from jaxsh.transfer import Material
        >>> round(float(Material.modified_phong(0.5, 0.3, 4.0).specular), 2)
        0.36
        """
        made = cls(diffuse, specular, exponent)
        dtype = jnp.promote_types(made.specular.dtype, made.exponent.dtype)
        exponents = made.exponent.astype(dtype)
        factor = (exponents + 2) / (exponents + 1)
        if factor.ndim:
            factor = factor[:, None]
        scaled = made.specular.astype(dtype)
        if factor.ndim and scaled.ndim == 1:
            scaled = scaled[None]
        return cls(made.diffuse, scaled * factor, made.exponent)

    def sharded(self, devices: Devices = None) -> "Material":
        """Share what is given per vertex out over devices, as `shard_rows` does.

        What all vertices share each device holds in full. Raises `ValueError` as it does.
        """
        check_known("material", self)
        mesh = mesh_of(devices)
        exponent = (share if self.exponent.ndim else whole)(self.exponent, mesh)
        diffuse, specular = (
            (share if albedo.ndim == 2 else whole)(albedo, mesh)
            for albedo in (self.diffuse, self.specular)
        )
        return Material(diffuse, specular, exponent)


def checked_light(
    light: Float[ArrayLike, "..."], count: int, degree: int, dtype: jnp.dtype
) -> Float[Array, "..."]:
    """Casts a light that all of `count` vertices share, or one for each, of at most this degree.

    Raises `ValueError` for one that is at hand and not finite.
    """
    light = as_finite(light, "light")
    lights = light.shape[:-2][-1:]  # () where all vertices share one
    if light.ndim < 2 or light.shape[-2] != 3 or lights not in ((), (1,), (count,)):
        raise ValueError(
            f"expected light (3, K), or (..., {count}, 3, K) with one for each vertex, or "
            f"(..., 1, 3, K) for a batch of shared ones, got shape {light.shape}"
        )
    if degree_of(light.shape[-1]) > degree:
        raise ValueError(
            f"the light's degree {degree_of(light.shape[-1])} is above the transfer's, {degree}; "
            f"cut it to light[..., :{(degree + 1) ** 2}]"
        )
    return _cast(light, dtype)


def checked_one_light(
    light: Float[ArrayLike, "..."], count: int, degree: int, dtype: jnp.dtype
) -> Float[Array, "3 k"]:
    """Casts a light (3, K) that all vertices share, of at most this degree."""
    light = checked_light(light, count, degree, dtype)
    if light.ndim > 2:
        raise ValueError(f"expected one light (3, K) for all vertices, got shape {light.shape}")
    return light


def checked_material(material: Material, count: int, dtype: jnp.dtype) -> Material:
    """Casts a material whose arrays per vertex are of `count` vertices."""
    check_type("material", material, Material)
    for name, ndim in (("diffuse", 2), ("specular", 2), ("exponent", 1)):
        array = getattr(material, name)
        if array.ndim == ndim and len(array) != count:
            raise ValueError(
                f"expected a material of {count} vertices, but its {name} is of {len(array)}"
            )
    arrays = (material.diffuse, material.specular, material.exponent)
    if all(array.dtype == dtype for array in arrays):
        return material
    return Material(*(array.astype(dtype) for array in arrays))


def checked_albedo(
    albedo: Float[ArrayLike, "..."], count: int, dtype: jnp.dtype
) -> Float[Array, "..."]:
    """Casts the albedo of a diffuse surface: a number, RGB, or per vertex with one or three."""
    albedo = as_finite(albedo, "albedo", least=0.0)
    if albedo.shape not in ((), (3,), (count, 1), (count, 3)):
        raise ValueError(
            f"expected albedo as a number, (3,), ({count}, 1) or ({count}, 3), got shape "
            f"{albedo.shape}"
        )
    return _cast(albedo, dtype)


def checked_eye(eye: Float[ArrayLike, "..."], dtype: jnp.dtype) -> Float[Array, " 3"]:
    """Casts a point or direction (3,)."""
    eye = as_finite(eye, "eye")
    if eye.shape != (3,):
        raise ValueError(f"expected eye (3,), got shape {eye.shape}")
    return _cast(eye, dtype)


def _cast(array: Array, dtype: jnp.dtype) -> Array:
    # To cast to the same type does nothing, but takes time of every frame.
    return array if array.dtype == dtype else array.astype(dtype)
