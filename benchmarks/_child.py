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
    import numpy as np

    from . import basis, first_call, lat_long

    jax.config.update("jax_enable_x64", request["dtype"] == "float64")
    rounds = request["rounds"]
    for degree in request["degrees"]:
        if request["table"] == "basis":
            for count in request["counts"]:
                for row in basis.timings(degree, count, np.dtype(request["dtype"]), rounds):
                    _emit(row | {key: request[key] for key in ("cores", "allocator")})
        elif request["table"] == "lat_long":
            for row in lat_long.timings(degree, 256, rounds):
                _emit(row | {"cores": request["cores"]})
        elif request["table"] == "first_call":
            for row in first_call.timings(rounds):
                _emit(row)
        else:
            _emit(basis.errors(degree))


def _emit(row: dict) -> None:
    print(json.dumps(row), flush=True)


if __name__ == "__main__":
    main(json.loads(sys.argv[1]))
