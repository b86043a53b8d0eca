"""What every method gives back."""

import equinox as eqx
from jaxtyping import Array, Float, Int


class AdaptiveResult(eqx.Module):
    """Colours of V vertices, and what they took.

    - `color`: radiance that leaves each vertex, diffuse and specular.
    - `kept`: by name, shares of the vertices, in [0, 1]. The filtering methods give "specular"
      and "diffuse", one share per level that was decided on; others name their own.
    - `spent`: multiply-adds per vertex, relative to the 3K² + 3K of the product matrix and the
      light. `shade_glossy` itself spends far less than one, since it sums over directions.
    - `reached`: by name as in `kept`, the degree that each vertex was computed to; empty where a
      method has no degrees. Given back as `previous`, the next frame remembers it.
    """

    color: Float[Array, "v 3"]
    kept: dict[str, Float[Array, "..."]]
    spent: Float[Array, ""]
    reached: dict[str, Int[Array, " v"]] = eqx.field(default_factory=dict)
