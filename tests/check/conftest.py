"""A picture, and its light by hand."""

import pytest
import samples


@pytest.fixture
def image(rng):
    return samples.picture(rng)


@pytest.fixture
def light(image):
    return samples.project(image)
