"""A triangle mesh that gives light."""

import equinox as eqx
from jaxtyping import Array, Float

from .._core.checks import as_float
from ..geometry import Mesh


class EmissiveMesh(eqx.Module):
    """A mesh whose faces emit `radiance` outwards, or to both sides.

    `radiance` is (3,), the same for all faces, or (F, 3). The front of a face is where its corners
    run counter-clockwise; a one-sided face is black from behind, and blocks.
    """

    mesh: Mesh
    radiance: Float[Array, "*faces 3"] = eqx.field(converter=as_float)
    two_sided: bool = eqx.field(static=True, default=False)

    def __check_init__(self):
        faces = len(self.mesh.faces)
        if self.radiance.shape not in ((3,), (faces, 3)):
            raise ValueError(
                f"expected radiance (3,) or one for each face ({faces}, 3), got shape "
                f"{self.radiance.shape}"
            )
