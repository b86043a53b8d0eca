"""Random lights in random conventions with noise: how often a check is right, open, or wrong.

PYTHONPATH=. python tests/check/sweep.py 20
"""

import collections
import dataclasses
import sys
import warnings

import numpy as np
import samples

import jaxsh
from jaxsh import harmonics
from jaxsh._check._search import threshold
from jaxsh._check._space import space

SIGNS = ("+", "-")


def random_convention(rng, degree):
    """Half of the time a named one, else any facts; up to the degree."""
    named = [c for c in harmonics.conventions().values() if c.degree is None or c.degree >= degree]
    if degree != 2:
        named = [c for c in named if isinstance(c.order, str)]
    if degree > 2:  # the others are not converted to there
        named = [c for c in named if c.quantity == "radiance"]
    if rng.random() < 0.5:
        return named[rng.integers(len(named))]
    normalizations = ["orthonormal", "4pi", "schmidt", "unnormalized"]
    normalizations += ["polynomial"] * (degree <= 2)
    axes = [SIGNS[rng.integers(2)] + axis for axis in rng.permutation(["x", "y", "z"])]
    quantities = ["radiance", "irradiance", "irradiance/pi"]
    return harmonics.Convention(
        phase=rng.choice(["none", "condon-shortley"]).item(),
        order=rng.choice(["ascending", "descending"]).item(),
        normalization=rng.choice(normalizations).item(),
        axes=tuple(axes),
        quantity=rng.choice(quantities[: 3 if degree <= 2 else 1]).item(),
        layout=rng.choice(["coefficients-last", "channels-last"]).item(),
    )


def trial(rng, *, degree, channels, noise, height, scaled, direction=False, other=False):
    """One verdict with what it should have been: "right", "open", "none" or "wrong"."""
    true = random_convention(rng, degree)
    if channels == 1 and true.layout != "cosine-sine":
        true = dataclasses.replace(true, layout="coefficients-last")
    if channels == 1 and true.layout == "cosine-sine":
        channels = 3
    if direction:
        known = {"direction": (d := rng.normal(size=3)) / np.linalg.norm(d)}
        strength = rng.uniform(0.5, 2, (channels, 1))
        light = strength * np.asarray(harmonics.evaluate(known["direction"], degree))[None]
    else:
        image = samples.picture(rng, height, channels, lamps=int(rng.integers(1, 5)))
        known = {"picture": image}
        # As from a picture of another size: every second pixel, and each by its solid angle.
        directions, solid = samples.pixels(height)
        basis = np.asarray(harmonics.evaluate(directions, degree))
        light = np.einsum("hwc,hwk,hw->ck", image, basis, solid)
    if other:  # what is known is of another light
        known = {"direction": rng.normal(size=3)} if direction else known
        known = known if direction else {"picture": samples.picture(rng, height, channels)}
    shape = np.linalg.norm(light[:, 1:]) / np.sqrt(light[:, 1:].size)
    spoilt = light + noise * shape * rng.normal(size=light.shape)
    scale = 2.0 ** rng.uniform(-4, 4) if scaled else 1.0
    given = scale * np.asarray(harmonics.convert(spoilt, "jaxsh", true))
    given = given[0] if channels == 1 and true.layout == "coefficients-last" else given
    verdict = jaxsh.check(given, **known)
    if not verdict.decided:
        return ("open" if verdict.found is not None else "none"), verdict, true
    if channels == 1:  # nothing shows the layout
        true = dataclasses.replace(true, layout=verdict.found.layout)
    fresh = rng.normal(size=(3, (degree + 1) ** 2))
    try:
        there = harmonics.convert(fresh, "jaxsh", true)
        back = np.asarray(harmonics.convert(there, verdict.found, "jaxsh"))
    except ValueError:
        return "wrong", verdict, true
    cosine = np.sum(back * fresh) / np.linalg.norm(back) / np.linalg.norm(fresh)
    good = cosine > 1 - 1e-6
    if not direction:
        ratio = np.linalg.norm(back) / np.linalg.norm(fresh) / verdict.scale * scale
        good &= abs(ratio - 1) < 0.1
    return ("right" if good else "wrong"), verdict, true


def rates(count, seed=0, show=False, **settings):
    """Counts of verdicts by kind."""
    rng = np.random.default_rng(seed)
    found = collections.Counter()
    for _ in range(count):
        kind, verdict, true = trial(rng, **settings)
        found[kind] += 1
        if show and kind == "wrong":
            print(true, verdict, sep="\n")
    return found


CASES = [
    dict(degree=degree, channels=channels, noise=noise, height=height, scaled=scaled)
    for degree in (1, 2, 3)
    for channels in (1, 3)
    for noise in (0.0, 0.03, 0.1, 0.3)
    for height, scaled in ((32, False), (16, True))
]
CASES += [
    dict(degree=degree, channels=3, noise=noise, height=16, scaled=True, direction=True)
    for degree in (1, 2, 3)
    for noise in (0.0, 0.03, 0.1)
]

if __name__ == "__main__":
    warnings.simplefilter("error")
    for degree in (1, 2):
        limit = threshold((degree + 1) ** 2, space(degree, degree).maps)
        print(f"a gray light of degree {degree} is met by chance to {100 * limit:.1f} %")
    count, tables = int(sys.argv[1]), collections.defaultdict(collections.Counter)
    for seed, case in enumerate(CASES):
        known = "direction" if case.get("direction") else "picture"
        key = known, case["degree"], case["channels"], case["noise"]
        tables[key] += rates(count, seed, show=True, **case)
    print("| known | degree | channels | noise | right | open | none fits | wrong |")
    print("|---|---|---|---|---|---|---|---|")
    for key, found in tables.items():
        cells = [*key, *(found[kind] for kind in ("right", "open", "none", "wrong"))]
        print(f"| {' | '.join(map(str, cells))} |")
    print(dict(sum(tables.values(), collections.Counter())))
