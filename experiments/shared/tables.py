"""Columns that several tables have."""

from ..runner import Column

PSNR = (
    Column("psnr_image", "PSNR, dB: image", digits=1),
    Column("psnr_object", "object", digits=1),
    Column("psnr_vertex", "vertices", digits=1),
)
GAINS = (
    Column("gain_product", "against product form", digits=2),
    Column("gain_einsum", "against einsum", digits=2),
)
RIVAL = (
    Column("rival", "truncation at its cost"),
    Column("rival_psnr_object", "its object PSNR", digits=1),
)


def named(*keys: str, digits: int | None = None) -> list[Column]:
    """Columns whose headings are their keys."""
    return [Column(key, key, digits=digits) for key in keys]
