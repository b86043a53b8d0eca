"""A ray scene that counts questions, and does something at one of them."""

from collections.abc import Callable

import numpy as np

from jaxsh.geometry import knot, ray_scene

MESH = knot(700)


def interrupt() -> None:
    raise KeyboardInterrupt


class Scene:
    def __init__(self, after: float = np.inf, do: Callable[[], object] = interrupt):
        self._scene, self.asked, self._after, self._do = ray_scene(MESH), 0, after, do

    def occluded(self, origins, directions, max_distance=np.inf):
        self._count()
        return self._scene.occluded(origins, directions, max_distance)

    def closest_hit(self, origins, directions):
        self._count()
        return self._scene.closest_hit(origins, directions)

    def _count(self) -> None:
        self.asked += 1
        if self.asked > self._after:
            self._do()
