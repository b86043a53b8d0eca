"""Valid calls of `jaxsh.viewer`."""

import numpy as np

from jaxsh import imaging, midrange, viewer

from .shared import K, eye, floats, made, of


def calls():
    arguments = {
        "transfer": made(),
        "light": floats(3, K),
        "faces": np.array([[0, 1, 2], [3, 4, 5]]),
        "albedo": floats(3),
        "textured": None,
        "camera": imaging.Camera(eye(), np.zeros(3), width=6, height=8),
        "exposure": 1.0,
        "names": ["studio"],
        "title": "jaxsh",
        "values": {"height": floats(made().num_points)},
        "sky": None,
        "lamp": None,
    }
    ball = midrange.Sphere(np.array([0.0, 0.0, 3.0]), 0.5, np.ones(3))
    rules = {"finite": "light albedo exposure", "host": True}
    return {
        "Lamp": of(
            viewer.Lamp,
            light=ball,
            grid=midrange.Grid(np.zeros(3), np.ones(3), (2, 2, 3)),
            position=floats(3),
            finite="position",
            host=True,
        ),
        "Sky": of(
            viewer.Sky,
            sun=floats(3),
            turbidity=3.0,
            disc=True,
            place=(48.2, 16.4),
            time="2026-06-21T10:00+00:00",
            scale=1.0,
            finite="sun turbidity scale",
            host=True,
        ),
        "export_html": of(
            viewer.export_html,
            path="/dev/null/no/knot.html",
            free="path title",
            **arguments,
            **rules,
        ),
        "view": of(viewer.view, height=480, free="title", **arguments, **rules),
    }
