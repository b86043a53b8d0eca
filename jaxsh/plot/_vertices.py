"""Numbers at the vertices of a mesh in false color."""

from collections.abc import Sequence

import jax
import matplotlib
import numpy as np
from jax.core import Tracer
from jaxtyping import ArrayLike, Bool, Float, Integer
from matplotlib.axes import Axes
from matplotlib.colors import BoundaryNorm, ListedColormap, to_rgb
from matplotlib.patches import Patch

from .._core import srgb
from .._core.checks import check_flag, check_number, check_type
from ..geometry import Mesh
from ..imaging import Camera
from ._arrays import check_labels, read
from ._axes import color_bar
from ._colors import NEGATIVE, POSITIVE, ColorScale, color_scale
from ._surface import relieved, see

_MOST = 24  # kinds that colors still tell apart


def vertices(
    mesh: Mesh,
    values: Float[ArrayLike, " v"] | Integer[ArrayLike, " v"] | Bool[ArrayLike, " v"],
    *,
    label: str,
    camera: Camera | None = None,
    limits: float | tuple[float, float] | None = None,
    log: bool = False,
    names: Sequence[str] | None = None,
    relief: float = 0.25,
    length: str = "mesh units",
    colorbar: bool = True,
    ax: Axes | None = None,
) -> Axes:
    """Draw numbers at the vertices of a mesh in false color, with a color bar.

    Floats are carried over the faces to pixels, then colored: from zero up in viridis, or around
    zero from blue to red where some are negative, as errors are. Integers (degrees, levels,
    materials) have one color each, and booleans (a region of interest) two.

    **Arguments**

    - `mesh`: what is seen.
    - `values`: (V,), jax or numpy: floats, integers or booleans. For (V, 3) radiance see `shaded`.
    - `label`: what the values are, with their unit: it stands beside the color bar.
    - `camera`: by default one in front (-y) and a little above, its picture cut to the mesh.
    - `limits`: (low, high) of the color bar, or one number: from zero to it, or from its negative.
      By default the values' own. Pictures that are compared want the same.
    - `log`: a logarithmic scale, for values that are not negative. Without limits it covers at most
      four decades.
    - `names`: of integers in rising order, or of False and True.
    - `relief`: how much darker than its color a surface is that is seen edge on, in 0 to 1, so that
      the shape shows.
    - `length`: unit of the mesh's lengths, for the bar below the picture.
    - `colorbar`: False leaves it, or the legend of names, away, where pictures share one.
    - `ax`: axes to draw on; by default those of a new figure.

    **Returns**

    The axes, in pixels. Runs on the host. Raises `ValueError` for values that are not finite or not
    one per vertex, and for a camera that does not see the mesh.

    **Example**

    >>> from jaxsh import geometry, imaging, plot
    >>> mesh = geometry.knot(300)
    >>> camera = imaging.Camera.facing(mesh, width=32, height=32)
    >>> ax = plot.vertices(mesh, mesh.vertices[:, 2], label="height, m", camera=camera)
    >>> ax.figure.axes[1].get_ylabel()
    'height, m'
    """
    check_type("label", label, str)
    check_type("length", length, str)
    log, colorbar = check_flag("log", log), check_flag("colorbar", colorbar)
    relief = check_number("relief", relief, least=0.0, most=1.0)
    check_type("mesh", mesh, Mesh)
    given = _given(values, len(mesh.vertices))
    if given.dtype.kind == "f":
        if names is not None:
            raise ValueError("names are for integers and booleans, got values in floats")
        scale = color_scale(given, limits, log)
        surface = see(mesh, camera)
        colors = scale.colors(surface.pixels(given[:, None])[..., 0])
        ax = surface.show(relieved(colors, surface.facing, relief), ax, length)
        if colorbar:
            color_bar(ax, scale, label)
        return ax
    if limits is not None or log:
        raise ValueError("limits and log are for values in floats, got integers or booleans")
    kinds = np.array([False, True]) if given.dtype == bool else np.unique(given)
    if len(kinds) > _MOST:
        raise ValueError(f"expected at most {_MOST} kinds of integers in values, got {len(kinds)}")
    check_labels("names", names, len(kinds))
    palette = _palette(kinds)
    surface = see(mesh, camera)
    # Colors mix in linear light, as the antialiased edge of a surface does.
    linear = surface.pixels(srgb.decode(palette)[np.searchsorted(kinds, given)])
    colors = relieved(srgb.encode(linear), surface.facing, relief)
    ax = surface.show(colors, ax, length)
    if colorbar:
        said = [str(kind) for kind in kinds.tolist()] if names is None else list(names)
        _key(ax, palette, said, label, legend=given.dtype == bool or names is not None)
    return ax


def _given(values, count: int) -> np.ndarray:
    known = isinstance(values, np.ndarray | jax.Array) and not isinstance(values, Tracer)
    if known and np.dtype(values.dtype).kind in "biu":
        array = np.asarray(values)
    else:
        array = read("values", values)
    if array.shape != (count,):
        hint = "; for radiance see plot.shaded" if array.ndim == 2 else ""
        raise ValueError(
            f"expected values ({count},), one per vertex, got shape {array.shape}{hint}"
        )
    return array


def _palette(kinds: np.ndarray) -> Float[np.ndarray, "n 3"]:
    if kinds.dtype == bool:
        return np.array([(0.62, 0.62, 0.62), to_rgb(POSITIVE)])
    if len(kinds) == 2:
        return np.array([to_rgb(NEGATIVE), to_rgb(POSITIVE)])
    return matplotlib.colormaps["viridis"](np.linspace(0, 1, len(kinds)))[:, :3]


def _key(ax: Axes, palette, said: list[str], label: str, *, legend: bool) -> None:
    """Draw a legend of words below the picture, or a color bar in steps for numbers."""
    if legend:
        patches = [Patch(color=tuple(c), label=name) for c, name in zip(palette, said, strict=True)]
        ax.legend(
            handles=patches,
            title=label,
            loc="upper left",
            bbox_to_anchor=(0.0, -0.02),
            frameon=False,
            fontsize="small",
        )
        return
    norm = BoundaryNorm(np.arange(len(said) + 1) - 0.5, len(said))
    bar = color_bar(ax, ColorScale(norm, ListedColormap(palette), "neither"), label)
    bar.set_ticks(list(range(len(said))), labels=said)
    bar.ax.tick_params(length=0, which="both")
