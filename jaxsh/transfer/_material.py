"""Surface materials, and the argument checks that all shading shares, made before tracing."""

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, ArrayLike, Float

from .._core.checks import as_double, as_finite, check_finite, check_known, check_type
from .._core.devices import Devices, mesh_of, share, whole
from .._core.known import is_concrete
from ..harmonics import degree_of


def _as_strong(name: str, least: float | None):
    """Converts to a type of its own, so that numbers and arrays run the same compiled programs."""

    def convert(value: ArrayLike) -> Float[Array, "..."]:
        if type(value) in (int, float):
            dtype = jnp.result_type(float)
            check_finite(name, as_double(name, value), dtype=dtype, least=least)
            value = np.asarray(value, dtype)
        array = as_finite(value, name, least=least, wait=True)
        return array.astype(array.dtype) if array.weak_type else array

    return convert


def _as_lobe(name: str):
    convert = _as_strong(name, None)
    return lambda value: None if value is None else convert(value)


class Material(eqx.Module):
    """Holds how a surface of V vertices or other points reflects: diffusely, and through a lobe.

    `diffuse` and `specular` are albedos: a number, RGB (3,), or per vertex (V, 1) or (V, 3). The
    lobe is Phong's with an `exponent`, or that of GGX with a `roughness`, each a number or (V,).
    Differentiable in all of them.

    Phong's lobe integrates to one over the sphere, as in Lee & Kim, so that with the cosine less
    than `specular` of uniform light is reflected: `modified_phong` takes the share itself. For the
    other see `ggx`.

    Raises `ValueError` for other shapes, unless there is either an exponent or a roughness, and
    where values are known and an albedo is not finite and >= 0, an exponent not finite and above
    -1, a roughness not from 0 to 1, or `specular` above 1 beside a roughness.

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
    exponent: Float[Array, "..."] | None = eqx.field(default=None, converter=_as_lobe("exponent"))
    roughness: Float[Array, "..."] | None = eqx.field(default=None, converter=_as_lobe("roughness"))

    def __check_init__(self):
        for name in ("diffuse", "specular"):
            array = getattr(self, name)
            if array.ndim > 2 or (
                array.ndim and array.shape[-1] not in ((3,), (1, 3))[array.ndim - 1]
            ):
                raise ValueError(
                    f"expected {name} as a number, (3,), (V, 1) or (V, 3), got shape {array.shape}"
                )
        if (self.exponent is None) == (self.roughness is None):
            raise ValueError(
                "expected an exponent, of Phong's lobe, or a roughness, of GGX's, got "
                f"{'neither' if self.exponent is None else 'both'}"
            )
        name, lobe = self.lobe
        if lobe.ndim > 1:
            raise ValueError(f"expected {name} as a number or (V,), got shape {lobe.shape}")
        if is_concrete(lobe):
            known = np.asarray(lobe)
            if name == "exponent" and not (known > -1).all():
                raise ValueError("exponent must be finite and above -1 everywhere")
            if name == "roughness" and not ((known >= 0) & (known <= 1)).all():
                raise ValueError(f"expected roughness from 0 to 1, got {_worst(known):g}")
        if name == "roughness" and is_concrete(self.specular):
            most = np.asarray(self.specular).max(initial=0)
            if most > 1:
                raise ValueError(
                    "expected specular of at most 1 beside a roughness, as the share that is "
                    f"reflected along the normal, got {most:g}"
                )
        counts = {
            name: len(array)
            for name, array, each in zip(
                ("diffuse", "specular", name),
                (self.diffuse, self.specular, lobe),
                self.per_vertex,
                strict=True,
            )
            if each
        }
        if len(set(counts.values())) > 1:
            raise ValueError(f"a material is of one mesh, but its numbers of vertices are {counts}")

    @property
    def lobe(self) -> tuple[str, Float[Array, "..."]]:
        """Names the lobe's parameter, "exponent" or "roughness", and gives its value."""
        if self.exponent is not None:
            return "exponent", self.exponent
        assert self.roughness is not None
        return "roughness", self.roughness

    @property
    def per_vertex(self) -> tuple[bool, bool, bool]:
        """Says of diffuse albedo, specular albedo and lobe if each vertex has its own."""
        return self.diffuse.ndim == 2, self.specular.ndim == 2, self.lobe[1].ndim == 1

    @classmethod
    def ggx(
        cls,
        diffuse: Float[ArrayLike, "..."],
        specular: Float[ArrayLike, "..."],
        roughness: Float[ArrayLike, "..."],
    ) -> "Material":
        """Make a rough metal or dielectric: its lobe is the nearest to GGX at each angle of view.

        What it stands for is D F G / (4 (n·ω) (n·ω_o)), of Walter et al. 2007, "Microfacet models
        for refraction through rough surfaces", with α = `roughness`², as in glTF, Smith's masking
        and shadowing, and Schlick's Fresnel term. `specular` is the reflectance along the normal:
        a metal's color, or 0.04 for a dielectric of index 1.5. For a metal `diffuse` is 0.

        Glossy shading takes a lobe around the mirrored direction. This one is fitted, least squares
        at the light's degree, for each roughness and angle of view. It reflects of uniform light
        what GGX does, to 1 %, at the horizon to 3 %; its shape is off by what `docs/glossy.md`
        says. Arguments of V vertices or texels, as for `Material`; differentiable in each, and
        through the angle in eye and normals. The table of a degree is fitted at its first use in a
        process, which takes about a second at degree 10 and fifteen at 20.

        Raises `ValueError` as `Material` does.

        **Example**

        >>> import jax.numpy as jnp
        >>> from jaxsh import transfer
        >>> up = jnp.asarray([[0.0, 0.0, 1.0]])
        >>> gold = transfer.Material.ggx(0.0, jnp.asarray([1.0, 0.8, 0.4]), roughness=0.5)
        >>> sky = jnp.zeros((3, 9)).at[:, 0].set((4 * jnp.pi) ** 0.5)  # radiance 1 from everywhere
        >>> color = transfer.shade_glossy(sky, transfer.unshadowed(up, up, 2), 5 * up[0], gold)
        >>> [round(float(channel), 2) for channel in color[0]]
        [0.92, 0.73, 0.37]
        """
        return cls(diffuse, specular, roughness=roughness)

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
        _, exponents = made.lobe
        dtype = jnp.promote_types(made.specular.dtype, exponents.dtype)
        exponents = exponents.astype(dtype)
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
        arrays, structure = jax.tree.flatten(self)
        shared = (
            (share if each else whole)(array, mesh)
            for array, each in zip(arrays, self.per_vertex, strict=True)
        )
        return jax.tree.unflatten(structure, shared)


def _worst(values: np.ndarray) -> float:
    return values.flat[np.argmax(np.abs(values - 0.5))]


def checked_light(
    light: Float[ArrayLike, "..."], count: int, degree: int, dtype: jnp.dtype
) -> Float[Array, "..."]:
    """Casts a light that all of `count` vertices share, or one for each, of at most this degree.

    Raises `ValueError` for one that is at hand and not finite.
    """
    light = as_finite(light, "light", dtype=dtype)
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
    return light


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
    names = "diffuse", "specular", material.lobe[0]
    for name, each in zip(names, material.per_vertex, strict=True):
        if each and len(getattr(material, name)) != count:
            raise ValueError(
                f"expected a material of {count} vertices, but its {name} is of "
                f"{len(getattr(material, name))}"
            )
    if all(array.dtype == dtype for array in jax.tree.leaves(material)):
        return material
    for name in names:
        if getattr(material, name) is not None:
            check_finite(f"{name} of the material", getattr(material, name), dtype=dtype)
    return jax.tree.map(lambda array: array.astype(dtype), material)


def checked_albedo(
    albedo: Float[ArrayLike, "..."], count: int, dtype: jnp.dtype
) -> Float[Array | np.ndarray, "..."]:
    """Casts the albedo of a diffuse surface: a number, RGB, or per vertex with one or three."""
    if isinstance(albedo, int | float) and not isinstance(albedo, bool):
        check_finite("albedo", as_double("albedo", albedo), dtype=dtype, least=0.0)
        return np.asarray(albedo, dtype)
    albedo = as_finite(albedo, "albedo", dtype=dtype, least=0.0)
    if albedo.shape not in ((), (3,), (count, 1), (count, 3)):
        raise ValueError(
            f"expected albedo as a number, (3,), ({count}, 1) or ({count}, 3), got shape "
            f"{albedo.shape}"
        )
    return albedo


def checked_eye(eye: Float[ArrayLike, "..."], dtype: jnp.dtype) -> Float[Array, " 3"]:
    """Casts a point or direction (3,)."""
    eye = as_finite(eye, "eye", dtype=dtype)
    if eye.shape != (3,):
        raise ValueError(f"expected eye (3,), got shape {eye.shape}")
    return eye
