"""The tables of `first_light`."""

import statistics
from collections.abc import Iterator, Sequence
from typing import Any

from ..runner import Column, Context, Table


def tables(context: Context, degrees: Sequence[int], width: int) -> Iterator[Table]:
    """Of all rows so far; `width` is that of the pictures that were timed."""
    bakes = [row for row in context.rows if "bake_seconds" in row]
    errors = [row for row in context.rows if "variant" in row]
    yield _goals(bakes[0], max(degrees))
    yield _by_degree(errors, degrees)
    yield _worth(errors, max(degrees))
    yield _times(context, bakes, max(degrees), width)
    yield Table("Meshes", rows=bakes)


def _goals(first: dict[str, Any], degree: int) -> Table:
    """What was asked of the bake, of the first mesh in the table."""
    rows = [
        {"goal": what, "limit": limit, "measured": first[key]}
        for what, limit, key in (
            ("bake / its rays alone, wall clock", 1.5, "bake_to_rays"),
            ("bake / its rays alone, CPU time", 1.5, "bake_to_rays_cpu"),
            ("peak memory, MB", 1500.0, "peak_megabytes"),
            ("relative RMS error of the transfer, %", 1.0, "transfer_error"),
            ("shading / reading the coefficients once", None, "shade_to_read"),
        )
    ]
    return Table("Goals", rows=rows, values={"first": first, "degree": degree})


def _by_degree(errors: list[dict[str, Any]], degrees: Sequence[int]) -> Table:
    rows: dict[tuple[str, ...], dict[str, Any]] = {}
    for row in errors:
        key = tuple(row[name] for name in ("mesh", "environment", "variant"))
        line = rows.setdefault(key, {k: row[k] for k in ("mesh", "environment", "variant")})
        line["suns"], line["reference"] = row["suns"], row["reference_error"]
        for key in ("error", "psnr", "error_split", "psnr_split"):
            line[f"{key} {row['degree']}"] = row[key]
    columns = [
        *(Column(name, name) for name in ("mesh", "environment", "variant")),
        *(Column(f"error {d}", f"degree {d}: error, %", digits=2) for d in degrees),
        Column("suns", "suns split off", digits=0),
        *(
            Column(f"error_split {d}", f"degree {d} with suns split: error, %", digits=2)
            for d in degrees
        ),
        Column("reference", "reference's own, %", digits=2),
        *(Column(f"psnr {d}", f"degree {d}: PSNR, dB", digits=1) for d in degrees),
        *(
            Column(f"psnr_split {d}", f"degree {d} with suns split: PSNR, dB", digits=1)
            for d in degrees
        ),
    ]
    return Table("Irradiance by degree", columns, list(rows.values()))


def _worth(errors: list[dict[str, Any]], degree: int) -> Table:
    rows: dict[tuple[str, str], dict[str, Any]] = {}
    for row in errors:
        if row["degree"] == degree:
            key = row["mesh"], row["environment"]
            line = rows.setdefault(key, dict(zip(("mesh", "environment"), key, strict=True)))
            line[f"{row['variant']} to shadowed"] = row["error_to_shadowed"]
            line[f"{row['variant']} to one bounce"] = row["error_to_one_bounce"]
    return Table(
        "What shadows and a bounce are worth",
        rows=list(rows.values()),
        values={"degree": degree},
    )


def _times(context: Context, bakes: list[dict[str, Any]], degree: int, width: int) -> Table:
    rows = []
    for row in bakes:
        stages = {
            stage: context.times[f"{row['mesh']}: {stage}"]["seconds"]
            for stage in ("suns", "raster", "reference")
        }
        rows.append(row | stages | {"rays": row["rays"] / 1e6})
    projections = [
        times["run_seconds"] for name, times in context.times.items() if name.startswith("project ")
    ]
    return Table(
        "Times",
        rows=rows,
        values={
            "degree": degree,
            "projecting_ms": 1000.0 * statistics.median(projections),
            "width": width,
        },
    )
