"""Valid calls of `jaxsh.plot`."""

import numpy as np
from matplotlib.figure import Figure

from jaxsh import imaging, plot

from .shared import floats, knot, of


def calls():
    p, one = plot, np.array([[1.0, 0.0, 3.0, 4.0]])
    ax = Figure().add_subplot()
    camera = imaging.Camera.facing(knot(), width=6, height=8)
    toward = np.array([0.0, -1.0, 0.0])
    tone = {"exposure": 1.0, "curve": "clip", "white": 2.0}
    panels = {"coefficients": one, "ax": ax, "finite": "coefficients", "slow": True}
    return {
        "ball": of(
            p.ball,
            light=one,
            of="mirror",
            toward=toward,
            **tone,
            resolution=4,
            ax=ax,
            finite="light toward",
            slow=True,
        ),
        "balloon": of(
            p.balloon,
            light=one,
            unit="",
            toward=toward,
            resolution=4,
            ax=ax,
            finite="light toward",
            free="unit",
            slow=True,
        ),
        "bands": of(
            p.bands,
            labels=["f"],
            unit="f² · sr",
            free="unit",
            **panels | {"ax": Figure().add_subplot()},  # logarithmic from then on
        ),
        "basis": of(
            p.basis, degree=1, toward=toward, resolution=4, ax=ax, finite="toward", slow=True
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
        "dome": of(
            p.dome,
            sky=one,
            label="luminance, kcd/m²",
            suns=toward,
            projection="equidistant",
            limits=2.0,
            log=False,
            **tone,
            resolution=4,
            colorbar=True,
            ax=ax,
            finite="sky suns",
            free="label suns",
            slow=True,
        ),
        "error_map": of(
            p.error_map,
            errors=floats(2, 3),
            x=np.arange(3.0),
            y=np.arange(2.0),
            label="error, %",
            x_label="elevation, °",
            y_label="turbidity",
            limits=2.0,
            log=False,
            numbers=True,
            colorbar=True,
            ax=ax,
            finite="errors x y",
            free="label x_label y_label",
            slow=True,
        ),
        "gradients": of(
            p.gradients,
            points=floats(4, 3),
            gradient=floats(4, 3),
            values=floats(4),
            label="radiance",
            unit="1/m",
            plane="xy",
            mesh=None,
            limits=2.0,
            length="m",
            colorbar=True,
            ax=ax,
            finite="points gradient values",
            free="label unit length values",
            slow=True,
        ),
        "light": of(p.light, light=one, height=4, **tone, ax=ax, finite="light", slow=True),
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
            ax=ax,
            finite="radiance",
            free="length camera",
            slow=True,
        ),
        "transfer_lobes": of(
            p.transfer_lobes,
            mesh=knot(),
            coefficients=floats(300, 4),
            vertices=None,
            count=2,
            size=0.1,
            unit="",
            camera=camera,
            length="m",
            ax=ax,
            finite="coefficients size",
            free="unit length camera",
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
            ax=ax,
            finite="values relief",
            free="values label length camera",
            slow=True,
        ),
    }
