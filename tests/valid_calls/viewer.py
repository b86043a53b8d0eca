"""Valid calls of `jaxsh.viewer`."""

import numpy as np

from jaxsh import imaging, viewer

from .shared import K, eye, floats, made, of


def calls():
    arguments = {
        "transfer": made(),
        "light": floats(3, K),
        "faces": np.array([[0, 1, 2], [3, 4, 5]]),
        "albedo": floats(3),
        "camera": imaging.Camera(eye(), np.zeros(3), width=6, height=8),
        "exposure": 1.0,
        "names": ["studio"],
        "title": "jaxsh",
        "values": {"height": floats(made().num_points)},
    }
    rules = {"finite": "light albedo exposure", "host": True}
    return {
        "export_html": of(
            viewer.export_html,
            path="/dev/null/no/knot.html",
            free="path title",
            **arguments,
            **rules,
        ),
        "view": of(viewer.view, height=480, free="title", **arguments, **rules),
    }
