"""Valid calls of `jaxsh.check`."""

import numpy as np

import jaxsh

from .shared import K, floats, of


def calls():
    def of_picture(given, picture):
        return jaxsh.check(given, picture)

    return {
        "check": of(
            jaxsh.check,
            given=floats(3, K),
            picture=None,
            direction=np.array([0.3, 0.5, 0.8]),
            finite="given direction",
            host=True,
        ),
        "check.of_picture": of(
            of_picture,
            given=floats(3, K),
            picture=floats(6, 12, 3),
            finite="given picture",
            free="picture",  # None is good
            host=True,
        ),
    }
