"""One process of measurements: pinned to one core or free to use all, chosen before JAX starts."""

import json
import os
import sys


def main(request: dict) -> None:
    """Print one JSON line per row, as it comes."""
    if request["cores"] == "one":
        if not hasattr(os, "sched_setaffinity"):
            raise SystemExit("pinning to one core needs Linux: choose --cores all")
        os.sched_setaffinity(0, [min(os.sched_getaffinity(0))])
    import jax

    from . import _sections

    jax.config.update("jax_enable_x64", request["dtype"] == "float64")
    section = _sections.load(request["section"])
    for row in section.timings(request["cores"], request["rounds"], request["dtype"]):
        cores = {"cores": request["cores"]} if len(section.cores) > 1 else {}
        print(json.dumps(row | cores), flush=True)


if __name__ == "__main__":
    main(json.loads(sys.argv[1]))
