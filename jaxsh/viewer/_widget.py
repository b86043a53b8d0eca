"""A mesh to relight in a notebook."""

import base64
import functools
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from jaxtyping import ArrayLike, Float, Int

from .._core.checks import check_size
from ..geometry import Mesh, Texels
from ..imaging import Camera
from ..transfer import CompressedTransfer, Material, Transfer
from ._lamp import Lamp, checked_place
from ._lights import checked_lights
from ._scene import Scene, make_scene
from ._script import script, styles
from ._sky import Sky, checked_sun, checked_turbidity
from ._still import Still

if TYPE_CHECKING:
    from anywidget import AnyWidget


def view(
    transfer: Transfer | CompressedTransfer,
    light: Float[ArrayLike, "*lights 3 k"] | None,
    faces: Int[ArrayLike, "f 3"] | Mesh | Texels,
    albedo: Float[ArrayLike, "..."] | Material | None = None,
    *,
    textured: bool | None = None,
    camera: Camera | None = None,
    exposure: float | None = None,
    names: Sequence[str] | None = None,
    title: str = "jaxsh",
    values: Mapping[str, ArrayLike] | None = None,
    sky: Sky | None = None,
    lamp: Lamp | None = None,
    height: int = 480,
) -> "AnyWidget":
    """Show a mesh in a notebook, to be seen from all sides and relit there and from Python.

    What is shown, and how it is handled, is as in the page that `export_html` writes. The mesh is
    sent once, when the widget is first drawn, and is not saved with the notebook; a picture of the
    first light is, for where no script runs. Assigning to the widget's `light` relights it: 3 K
    numbers are sent. So do its `sun` and `turbidity` where there is a `Sky`, and the position
    `lamp` where there is a `Lamp`, with three numbers or one. Needs the package anywidget (`pip
    install 'jaxsh[viewer]'`).

    **Arguments** are those of `export_html`, but for the path; and `height` in pixels.

    **Returns** the widget. Its `light` is (3, K) or (n, 3, K), as many lights as at first and of
    their degree. Runs on the host. Raises as `export_html` does, and `ImportError` without
    anywidget.

    **Example**

    >>> from jaxsh import geometry, imaging, sphere, transfer, viewer
    >>> mesh = geometry.knot(300)
    >>> made = transfer.unshadowed(mesh.vertices, mesh.normals, degree=2)
    >>> light = sphere.project_lat_long(imaging.studio(16, 32), degree=2)
    >>> try:
    ...     widget = viewer.view(made, light, mesh.faces)
    ...     widget.light = 2 * light
    ... except ImportError as error:  # without anywidget
    ...     assert "anywidget" in str(error)
    """
    height = check_size("height", height, 100)
    scene = make_scene(
        transfer,
        light,
        faces,
        albedo,
        textured=textured,
        camera=camera,
        exposure=exposure,
        names=names,
        title=title,
        values=values,
        sky=sky,
        lamp=lamp,
    )
    return _widget_class()(
        scene, height, Still(scene.transfer, scene.surface, scene.albedo, height, lamp)
    )


@functools.cache
def _widget_class() -> Any:
    try:
        import anywidget
        import traitlets
    except ImportError as error:
        raise ImportError(
            "a viewer in a notebook needs the package anywidget: pip install 'jaxsh[viewer]', or "
            "write a page by export_html"
        ) from error

    class ViewerWidget(anywidget.AnyWidget):
        """Holds the lights; the mesh goes to each page that asks for it."""

        _esm = script("widget")
        _css = styles()
        lights = traitlets.List().tag(sync=True)
        moved = traitlets.Dict().tag(sync=True)
        height = traitlets.Int().tag(sync=True)

        def __init__(self, scene: Scene, height: int, still: Still):
            given = scene.header["kinds"].count("given")
            super().__init__(lights=scene.header["lights"][:given], height=height)
            self._scene, self._still = scene, still
            self.on_msg(self._answer)

        def _answer(self, widget, message, buffers):
            if message == {"kind": "ready"}:
                header = self._scene.header
                self.send({"kind": "scene", "header": header}, buffers=[self._scene.arrays])

        def _repr_mimebundle_(self, **options):
            bundle = super()._repr_mimebundle_(**options)
            if bundle is None:
                return None
            data, metadata = bundle
            first = (self.lights or self._scene.header["lights"])[0]
            picture = self._still.png(np.asarray(first), self._scene.header)
            shown = {"text/plain": f"viewer of {self._scene.header['numVertices']} vertices"}
            shown["image/png"] = base64.b64encode(picture).decode("ascii")
            return data | shown, metadata

        @property
        def light(self):
            """The lights that were given, lists (n, 3, K)."""
            return self.lights

        @light.setter
        def light(self, light):
            lights = checked_lights(light, self._scene.header["degree"])
            known = self.lights
            if not known:
                raise ValueError("expected no light, for there was none at first but sky or lamp")
            if lights.shape != (len(known), 3, len(known[0][0])):
                raise ValueError(
                    f"expected light ({len(known)}, 3, {len(known[0][0])}) as at first, got shape "
                    f"{lights.shape}"
                )
            self.lights = lights.tolist()

        @property
        def sun(self):
            """The direction of the sky's sun as it was last set from here, a list (3,)."""
            return self.moved.get("sun", self._of("sky")["sun"])

        @sun.setter
        def sun(self, sun):
            self._of("sky")
            self.moved = self.moved | {"sun": checked_sun(sun).tolist()}

        @property
        def turbidity(self):
            """The haze of the sky as it was last set from here."""
            return self.moved.get("turbidity", self._of("sky")["turbidity"])

        @turbidity.setter
        def turbidity(self, turbidity):
            self._of("sky")
            self.moved = self.moved | {"turbidity": checked_turbidity(turbidity)}

        @property
        def lamp(self):
            """The lamp's position as it was last set from here, a list (3,)."""
            return self.moved.get("lamp", self._of("near")["lamp"])

        @lamp.setter
        def lamp(self, position):
            self._of("near")
            self.moved = self.moved | {"lamp": checked_place(position).tolist()}

        def _of(self, name):
            if name not in self._scene.header:
                raise ValueError(f"expected a viewer with a {'lamp' if name == 'near' else name}")
            return self._scene.header[name]

    return ViewerWidget
