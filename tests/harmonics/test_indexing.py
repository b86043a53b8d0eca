"""Coefficient i = l(l+1) + m."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from jaxsh import harmonics


def test_the_first_two_bands_in_order():
    assert harmonics.degrees(2).tolist() == [0, 1, 1, 1, 2, 2, 2, 2, 2]
    assert harmonics.orders(2).tolist() == [0, -1, 0, 1, -2, -1, 0, 1, 2]
    assert harmonics.degrees(0).tolist() == harmonics.orders(0).tolist() == [0]


@given(st.integers(0, 200))
def test_degree_of_inverts_num_coefficients(degree):
    assert harmonics.num_coefficients(degree) == (degree + 1) ** 2
    assert harmonics.degree_of((degree + 1) ** 2) == degree


@given(st.integers(-5, 10**6))
def test_degree_of_takes_squares_alone(count):
    if count > 0 and round(count**0.5) ** 2 == count:
        assert harmonics.degree_of(count) == round(count**0.5) - 1
    else:
        with pytest.raises(ValueError, match=rf"1, 4, 9, 16.*got {count}$"):
            harmonics.degree_of(count)


def test_degree_of_is_exact_where_a_float_root_is_not():
    assert harmonics.degree_of((10**9 + 1) ** 2) == 10**9
    with pytest.raises(ValueError, match="got 100000000"):
        harmonics.degree_of(10**16 + 1)


@given(st.integers(0, 30))
def test_index_agrees_with_degrees_and_orders(degree):
    l, m = harmonics.degrees(degree), harmonics.orders(degree)
    assert [harmonics.index(int(a), int(b)) for a, b in zip(l, m, strict=True)] == [*range(len(l))]


@pytest.mark.parametrize(("l", "m"), [(-1, 0), (1, 2), (1, -2), (0, 1)])
def test_index_refuses_orders_beyond_the_degree(l, m):
    with pytest.raises(ValueError, match=r"m as an integer from -l to l|l must be an integer >= 0"):
        harmonics.index(l, m)


@pytest.mark.parametrize("degree", [-1, 2.0, "2", None, True])
def test_a_degree_is_an_integer_from_zero(degree, unchecked):
    calls = (
        harmonics.num_coefficients,
        harmonics.degrees,
        harmonics.orders,
        harmonics.gaunt,
        harmonics.clamped_cosine,
        lambda degree: harmonics.evaluate(np.ones(3), degree),
        lambda degree: harmonics.evaluate_with_gradient(np.ones(3), degree),
        lambda degree: harmonics.phong(1.0, degree),
        lambda degree: harmonics.window("hann", degree),
        lambda degree: harmonics.damping(1.0, degree),
        lambda degree: harmonics.rotation_matrix(np.eye(3), degree),
    )
    for call in calls:
        with pytest.raises(ValueError, match=f"degree must be an integer >= 0.*got {degree!r}"):
            call(degree)


def test_a_numpy_integer_is_a_degree(unchecked):
    assert harmonics.num_coefficients(np.int64(3)) == 16
