"""Valid calls of `jaxsh.plot`."""

import numpy as np

from jaxsh import plot

from .shared import of


def calls():
    p, one = plot, np.array([[1.0, 0.0, 3.0, 4.0]])
    return {
        "bands": of(
            p.bands, coefficients=one, labels=["f"], ax=None, finite="coefficients", slow=True
        ),
        "light": of(p.light, light=one, height=4, exposure=1.0, ax=None, finite="light", slow=True),
        "lobes": of(
            p.lobes,
            coefficients=one,
            titles=["f"],
            same_scale=True,
            resolution=8,
            ax=None,
            finite="coefficients",
            slow=True,
        ),
    }
