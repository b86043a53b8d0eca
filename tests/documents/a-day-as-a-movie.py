"""A small mesh and three frames of the page's movie. Without PyEphem there is nothing to try."""

import importlib.util
import itertools

from jaxsh import geometry, imaging

if importlib.util.find_spec("ephem") is None:
    print("ephem is not installed: the page is not tried")
    raise SystemExit


def small(knot=geometry.knot):
    geometry.knot = lambda _: knot(300)


def short(write=imaging.write_movie):
    imaging.write_movie = lambda path, frames, **more: write(
        path, itertools.islice(frames, 3), **more
    )


small()
short()
