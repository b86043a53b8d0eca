"""The public function: arguments, and which tests they allow."""

import math
from collections.abc import Callable
from dataclasses import replace

import numpy as np
from jaxtyping import ArrayLike, Float

from .._core.checks import as_host_float, check_finite, described
from .._core.pictures import check_shape
from ._alone import check_alone
from ._basis import check_basis
from ._broken import explain, windowed
from ._decide import cases, decide
from ._given import MOST, Light, Reading, mistaken, of_direction, of_picture, read, tinted
from ._known import furnace, judge
from ._search import FLOOR
from ._space import space
from ._verdict import Verdict
from ._words import percent

# A picture with a larger part of its values at the maximum has been cut off there.
_CLIPPED = 1e-3

# Of a degree and a number of channels.
_Lights = Callable[[int, int], list[Light]]


def check(
    given: Float[ArrayLike, "..."] | Callable,
    picture: Float[ArrayLike, "h w *c"] | None = None,
    *,
    direction: Float[ArrayLike, "3"] | None = None,
) -> Verdict:
    """Find out what convention coefficients from elsewhere are in, and say it in words.

    All combinations of the facts in `harmonics.conventions()` are tried: signs, order,
    normalization, axes in every right- or left-handed placement, layout and quantity, up to a
    scale. What agrees is named, with the call of `harmonics.convert` that follows; where several
    agree, so is what would decide. Where none does, single coefficients that break the nearest one
    are named, and mistakes of the picture: gamma-encoded, clipped, white-balanced, pixels weighted
    equally.

    **Arguments**

    - `given`: coefficients of one light in any layout, (C, K), (K, C), (K,), (3·K,) or
      (C, 2, L+1, L+1). Or the other's basis itself, a function from unit directions (N, 3) to
      values (N, K), or from one direction to K values: that shows most, with constants and signs
      function by function, whether it is orthonormal and invariant under rotation. K is of degree
      8 at most.
    - `picture`: (H, W, C) or (H, W), linear radiance, lat-long as everywhere in jaxsh, that the
      coefficients were made of. A constant one tests constants only.
    - `direction`: x, y, z in jaxsh's axes of the only light there was, in place of a picture. What
      it is convolved with may be the clamped cosine, of irradiance. Let x, y and z all differ.

    **Returns** a `Verdict`, to be printed or read. Of coefficients without a picture or direction
    it is never decided: they only exclude conventions in which no light is nowhere negative.
    Noise of a few percent, another resolution of the picture and gray light in place of color do
    not disturb it; beyond degree 8 coefficients are not looked at.

    Runs in NumPy on the host, but for the picture's projection: not for traced values, not
    differentiable. Raises `ValueError` for arguments of another shape and values that are not
    finite, and `TypeError` where both a picture and a direction are given.

    **Example**

    >>> import numpy as np
    >>> import jaxsh
    >>> from jaxsh import harmonics, imaging, sphere
    >>> picture = imaging.studio()
    >>> ours = sphere.project_lat_long(picture, degree=2)
    >>> theirs = np.asarray(harmonics.convert(ours, "jaxsh", "three.js"))  # (9, 3)
    >>> print(jaxsh.check(theirs, picture).agree)
    ('three.js',)
    """
    if picture is not None and direction is not None:
        raise TypeError("expected a picture or a direction, got both")
    if callable(given):
        if picture is not None or direction is not None:
            raise TypeError("expected a basis alone, got it with a picture or a direction")
        return check_basis(given)
    readings = read(given)
    if direction is not None:
        return _from_direction(readings, _as_direction(direction))
    if picture is not None:
        return _from_picture(readings, _as_picture(picture))
    return check_alone(readings)


def _as_direction(direction) -> np.ndarray:
    array = as_host_float(direction, "direction").astype(np.float64)
    check_finite("direction", array)
    if array.shape != (3,) or not array.any():
        raise ValueError(f"expected direction as one nonzero x, y, z, got {described(direction)}")
    return array


def _as_picture(picture) -> np.ndarray:
    array = as_host_float(picture, "picture")
    array = array[..., None] if array.ndim == 2 else array
    check_shape("picture", array.shape, lat_long=True)
    if min(array.shape[:2]) < 3:
        raise ValueError(
            f"expected picture of 3 rows or more, which show directions, got shape {array.shape}"
        )
    check_finite("picture", array, wait=True)
    if not array.any():
        raise ValueError("picture must not be black throughout: there is nothing to check")
    return array


def _from_direction(readings: list[Reading], direction: np.ndarray) -> Verdict:
    return _verdict(
        [_strongest(reading) for reading in readings],
        lambda degree, channels: of_direction(direction, degree),
        None,
        strength=False,
    )


def _strongest(reading: Reading) -> Reading:
    """The one function that all channels are multiples of, where the light has one color."""
    left, sizes, right = np.linalg.svd(reading.channels, full_matrices=False)
    sign = np.sign(left[:, 0].sum()) or 1.0
    apart = float(np.linalg.norm(sizes[1:]) / sizes[0])
    return reading._replace(channels=sign * sizes[:1, None] * right[:1], apart=apart)


def _from_picture(readings: list[Reading], picture: np.ndarray) -> Verdict:
    most = (min(picture.shape[:2]) - 1) // 2
    verdict = _verdict(
        readings,
        lambda degree, channels: of_picture(picture, min(degree, most), channels),
        lambda degree, channels: mistaken(picture, min(degree, most), channels),
        strength=True,
        most=most,
        channels=picture.shape[2],
    )
    largest = float(np.mean(picture == picture.max()))
    if verdict.decided or largest < _CLIPPED or np.ptp(picture) == 0:
        return verdict
    note = f"the picture is clipped: {percent(largest)} of its values are the largest one"
    return replace(verdict, notes=(*verdict.notes, note))


def _verdict(
    readings: list[Reading],
    lights: _Lights,
    mistakes: _Lights | None,
    *,
    strength: bool,
    most: int = MOST,
    channels: int = 1,
) -> Verdict:
    groups: dict[int, list[Reading]] = {}
    for reading in readings:
        groups.setdefault(math.isqrt(reading.channels.shape[1]) - 1, []).append(reading)
    verdicts = []
    for whole, some in groups.items():
        degree = min(whole, MOST, most)
        table = space(degree, whole)
        counts = {len(reading.channels) for reading in some}
        known = {count: lights(degree, count) for count in counts}
        found = cases(some, known, table)
        if not found:
            continue
        shape = np.linalg.norm(found[0].light.coefficients[:, 1:])
        if shape <= FLOOR * np.linalg.norm(found[0].light.coefficients):
            return furnace(found, table)
        decision = decide(found, table, free_scale=not strength)
        if mistakes and decision.best.error > FLOOR:
            others = {count: mistakes(degree, count) for count in counts}
            more = cases(some, others, table)
            for reading in some:
                count = len(reading.channels)
                more += cases([reading], {count: tinted(reading, known[count])}, table)
            decision = decide([*found, *more], table, free_scale=not strength)
            found = [*found, *more]
        verdict, doubt = windowed(found, decision, table, strength=strength)
        if verdict is None:
            tell = judge if decision.fits else explain
            verdict = tell(found, decision, table, strength=strength)
        if doubt:
            verdict = replace(verdict, decided=False, open=(*verdict.open, doubt))
        verdicts.append((decision, verdict))
    if not verdicts:
        counts = sorted({len(reading.channels) for reading in readings})
        raise ValueError(
            "expected given with the channels of picture, or with one, got "
            f"{' or '.join(map(str, counts))} beside {channels} of picture"
        )
    return min(verdicts, key=lambda pair: pair[0].best.error)[1]
