"""Valid calls of `jaxsh.plot`."""

import numpy as np

from jaxsh import imaging, plot

from .shared import floats, knot, of


def calls():
    p, one = plot, np.array([[1.0, 0.0, 3.0, 4.0]])
    camera = imaging.Camera.facing(knot(), width=6, height=8)
    toward = np.array([0.0, -1.0, 0.0])
    tone = {"exposure": 1.0, "curve": "clip", "white": 2.0}
    panels = {"coefficients": one, "ax": None, "finite": "coefficients", "slow": True}
    return {
        "ball": of(
            p.ball,
            light=one,
            of="mirror",
            toward=toward,
            **tone,
            resolution=4,
            ax=None,
            finite="light toward",
            slow=True,
        ),
        "balloon": of(
            p.balloon,
            light=one,
            unit="",
            toward=toward,
            resolution=4,
            ax=None,
            finite="light toward",
            free="unit",
            slow=True,
        ),
        "bands": of(p.bands, labels=["f"], unit="f² · sr", free="unit", **panels),
        "basis": of(
            p.basis, degree=1, toward=toward, resolution=4, ax=None, finite="toward", slow=True
        ),
        "coefficients": of(
            p.coefficients,
            titles=["f"],
            label="c",
            limits=2.0,
            numbers=True,
            colorbar=True,
            free="label",
            **panels,
        ),
        "light": of(p.light, light=one, height=4, exposure=1.0, ax=None, finite="light", slow=True),
        "lobes": of(
            p.lobes,
            titles=["f"],
            same_scale=True,
            unit="",
            toward=toward,
            resolution=8,
            free="unit",
            **panels | {"finite": "coefficients toward"},
        ),
        "shaded": of(
            p.shaded,
            mesh=knot(),
            radiance=floats(300, 3),
            camera=camera,
            **tone,
            length="m",
            ax=None,
            finite="radiance",
            free="length camera",
            slow=True,
        ),
        "vertices": of(
            p.vertices,
            mesh=knot(),
            values=floats(300),
            label="height, m",
            camera=camera,
            limits=2.0,
            log=False,
            names=None,
            relief=0.2,
            length="m",
            colorbar=True,
            ax=None,
            finite="values relief",
            free="values label length camera",
            slow=True,
        ),
    }
