"""The paper's polynomial: its accuracy, its monomials, the C header, the authors' tables."""

import os
import pathlib
import shutil
import subprocess

import numpy as np
import pytest
from suns import sun_at

from jaxsh import harmonics, sky

TABLES = pathlib.Path(os.environ.get("JAXSH_DATA", "missing")) / "reference/habel2008_tables.npz"


@pytest.fixture(scope="module")
def full():
    """Of the paper's degrees in θ and τ, for few bands."""
    return sky.habel2008_fit(degree=2, solver="qr", samples=(20, 12))


@pytest.fixture(scope="module")
def small():
    return sky.habel2008_fit((6, 4), degree=2, solver="qr")


def angles(rng, count):
    return rng.uniform(0, np.pi / 2, count), rng.uniform(2.5, 6, count)


def slow_equation_1(table, theta, tau):
    """Term by term: (C, K)."""
    k, high, wide, channels = table.shape
    c = np.zeros((channels, k))
    for i in range(high):
        for j in range(wide):
            c += table[:, i, j].T * theta**i * tau**j
    return c


@pytest.mark.slow
def test_how_good_the_papers_polynomial_is():
    """The paper says less than 0.005 % up to 5 bands. Weights are fitted one by one."""
    elevation, turbidity = np.linspace(0, 90, 14)[:, None], np.linspace(2.5, 6, 12)[None]
    sun = sun_at(elevation)
    exact = sky.project_preetham(sun, turbidity, 4)
    fit = sky.habel2008_fit(degree=4, solver="qr", samples=(20, 12))
    error = sky.fit_error(fit(sun, turbidity), exact, sky.smallest_luminance(sun, turbidity))
    assert 0.2 < 100 * error.mean.max() < 0.3


@pytest.mark.slow
@pytest.mark.parametrize(("size", "error"), [("small", 1e-12), ("full", 1e-6)])
def test_monomials_are_the_same_polynomial(size, error, request, rng):
    """In float64, to what the sum of monomials leaves: 1e-13 at degree (5, 3), 1e-6 at (13, 7)."""
    fit = request.getfixturevalue(size)
    table = sky.habel2008_monomials(fit)
    assert table.dtype == np.float64
    assert (table[harmonics.orders(fit.degree) < 0] == 0).all()
    for theta, tau in zip(*angles(rng, 10), strict=True):
        expected = np.asarray(fit(sun_at(90 - np.degrees(theta)), tau))
        found = slow_equation_1(table, theta, tau)
        assert np.linalg.norm(found - expected) < error * np.linalg.norm(expected)


@pytest.mark.slow
def test_monomials_in_float32_are_useless(full):
    """At low sun and high turbidity, which is why fits are kept in Chebyshev polynomials."""
    table = sky.habel2008_monomials(full).astype("f4")
    theta, tau = np.float32(1.5), np.float32(5.8)
    powers = theta ** np.arange(14, dtype="f4"), tau ** np.arange(8, dtype="f4")
    expected = np.asarray(full(sun_at(90 - np.degrees(1.5)), 5.8))
    raw = np.einsum("kijc,i,j->ck", table, *powers)
    assert np.linalg.norm(raw - expected) > 0.1 * np.linalg.norm(expected)
    single = full(sun_at(90 - np.degrees(1.5)).astype("f4"), 5.8)
    assert np.linalg.norm(np.asarray(single) - expected) < 2e-6 * np.linalg.norm(expected)


@pytest.mark.skipif(shutil.which("cc") is None, reason="no C compiler")
@pytest.mark.parametrize(
    ("size", "error"), [("small", 1e-12), pytest.param("full", 1e-6, marks=pytest.mark.slow)]
)
def test_the_header_compiles_and_agrees(size, error, request, rng, tmp_path):
    fit, name = request.getfixturevalue(size), f"{size}_sky"
    (tmp_path / "sky.h").write_text(sky.c_header(fit, name))
    (tmp_path / "main.c").write_text(PROGRAM.replace("NAME", name).replace("GUARD", name.upper()))
    subprocess.run(
        [*COMPILE, "main.c", "-o", "main", "-lm"],
        cwd=tmp_path,
        check=True,
    )
    for theta, tau in zip(*angles(rng, 3), strict=True):
        phi = rng.uniform(-np.pi, np.pi)
        output = subprocess.run(
            [tmp_path / "main", *(f"{value:.17g}" for value in (theta, phi, tau))],
            capture_output=True,
            check=True,
        ).stdout
        expected = np.asarray(fit(sun_at(90 - np.degrees(theta), np.degrees(phi)), tau))
        found = np.array(output.split(), float).reshape(expected.shape)
        assert np.linalg.norm(found - expected) < error * np.linalg.norm(expected)


COMPILE = ["cc", "-std=c89", "-Wall", "-Wextra", "-Werror", "-pedantic", "-O1"]
PROGRAM = """
#include <stdio.h>
#include <stdlib.h>
#include "sky.h"

int main(int count, char **word)
{
    double sky_light[GUARD_CHANNELS][(GUARD_DEGREE + 1) * (GUARD_DEGREE + 1)];
    double *value = &sky_light[0][0];
    size_t i;
    if (count != 4)
        return 1;
    NAME(atof(word[1]), atof(word[2]), atof(word[3]), sky_light);
    for (i = 0; i < sizeof sky_light / sizeof *value; ++i)
        printf("%.17g\\n", value[i]);
    return 0;
}
"""


def test_only_polynomials_have_monomials(small):
    with pytest.raises(ValueError, match="only a plain fit"):
        sky.habel2008_monomials(sky.preetham_table("small"))
    with pytest.raises(ValueError, match="a name in C, got 'my sky'"):
        sky.c_header(small, "my sky")


@pytest.mark.skipif(not TABLES.is_file(), reason="JAXSH_DATA has no table of the authors")
def test_the_authors_tables_within_three_per_cent(rng):
    """In cd/m², with their sun at azimuth π: weights of odd m change sign."""
    table = np.load(TABLES)["coefficients"] / 1000
    m = harmonics.orders(6)
    for theta, tau in zip(*angles(rng, 20), strict=True):
        theirs = slow_equation_1(table, theta, tau) * (-1.0) ** m
        exact = np.asarray(sky.project_preetham(sun_at(90 - np.degrees(theta)), tau))
        assert np.linalg.norm(theirs - exact) < 0.03 * np.linalg.norm(exact)
