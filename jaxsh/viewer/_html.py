"""A page with a mesh to relight, in one file."""

import base64
import gzip
import html
import json
import os
from collections.abc import Mapping, Sequence
from pathlib import Path
from string import Template

from jaxtyping import ArrayLike, Float, Int

from .._core.checks import as_path
from .._core.files import check_place, put_in_place
from ..geometry import Mesh, Texels
from ..imaging import Camera
from ..transfer import CompressedTransfer, Material, Transfer
from ._lamp import Lamp
from ._scene import make_scene
from ._script import script, styles, text
from ._sky import Sky


def export_html(
    path: str | os.PathLike[str],
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
) -> Path:
    """Write a mesh to one HTML file, in which it is seen from all sides and relit.

    The file works in every browser with WebGL2, without a network and without a server, also from
    a mail or an archive. Dragging orbits; dragging with Shift, or the mirror ball that shows the
    light, turns it, exactly, for its coefficients are rotated; sliders set exposure, intensity and
    the degree at which the light is cut. What is shown is `transfer.shade_diffuse` of the light,
    carried over the faces as by `imaging.interpolate`, then `imaging.tone_map(…, exposure)`. A
    window (`harmonics.window`, of the degree at which the light is cut) may be laid on it. Under a
    `Sky` the sun is dragged, or set by date and place; a `Lamp` is dragged, and shades each vertex
    by its own light, as `midrange.shade` does. Transfer is rounded to 16 bits, each harmonic in
    steps of 1/32767 of its largest coefficient.

    **Arguments**

    - `path`: of the file, which is replaced. Missing folders are made.
    - `transfer`: of the V vertices of a mesh, as from `transfer.bake` or `unshadowed`, whose
      positions are the mesh's; or of the V texels of a picture over one. That of
      `transfer.compress` makes the file smaller; the page unpacks it.
    - `light`: coefficients (3, K), or (n, 3, K) for several that a menu chooses from; of degree 10
      and the transfer's at most. What the transfer has beyond the light's degree is not written.
      None with a sky or a lamp alone, which are of the transfer's degree.
    - `faces`: (f, 3), the mesh's; or the `geometry.Mesh` itself, whose materials, textures and
      vertex colors can then be shown; or the `geometry.Texels` that the transfer is of, which are
      shaded one by one, and looked up at each pixel as by `imaging.sample_texture`.
    - `albedo`: a number, RGB (3,), or per vertex or texel (V, 1) or (V, 3); or a
      `transfer.Material` with one specular albedo, a number or (3,), and one exponent, for
      `transfer.shade_glossy` towards the camera; under a lamp the diffuse part alone is shown. By
      default the base color of a mesh that has one, and 0.8 elsewhere.
    - `textured`: whether the mesh's base color, at each pixel as by `imaging.base_color`,
      multiplies the diffuse albedo: by default where no albedo is given. Textures go as PNG.
    - `camera`: where the picture starts; by default `imaging.Camera.facing` the mesh. A window of
      another shape than its picture shows more beside or above it, never less.
    - `exposure`: the factor of linear radiance from which the exposure's slider counts; by default
      `imaging.auto_exposure` of all vertices under the first light.
    - `names`: of the lights in the menu: those that are given, the sky, the lamp.
    - `title`: of the page.
    - `values`: further numbers (V,) at vertices or texels by name, to be shown in false color.
      Floats run through the colors from the least to the greatest. Integers of at most 8 kinds are
      levels with a color each, laid over the picture: of an `adaptive.AdaptiveResult`,
      `shown_degree["specular"]` shows how far Lee & Kim's filter went at each vertex.
    - `sky`, `lamp`: further lights, which the page itself computes as they are moved.

    **Returns** the path. Runs on the host. Raises `ValueError` for shapes and degrees that do not
    fit, for a mesh or texels that the transfer is not of, for values that are not finite and for an
    albedo below 0, `TypeError` for objects of another class, and `OSError` where the file cannot
    be written.

    **Example**

    >>> import pathlib, tempfile
    >>> from jaxsh import geometry, imaging, sphere, transfer, viewer
    >>> mesh = geometry.knot(300)
    >>> made = transfer.unshadowed(mesh.vertices, mesh.normals, degree=2)
    >>> light = sphere.project_lat_long(imaging.studio(16, 32), degree=2)
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     page = viewer.export_html(pathlib.Path(folder) / "knot.html", made, light, mesh.faces)
    ...     page.name, page.stat().st_size < 200_000
    ('knot.html', True)
    """
    path = as_path(path)
    check_place(path)
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
    arrays = base64.b64encode(gzip.compress(scene.arrays, mtime=0)).decode("ascii")
    page = Template(text("page.html")).substitute(
        title=html.escape(title),
        style=styles(),
        # No "</script>" from a name ends the element.
        header=json.dumps(scene.header).replace("<", "\\u003c"),
        arrays=arrays,
        script=script("page"),
    )
    put_in_place({path: page.encode("utf-8")})
    return path
