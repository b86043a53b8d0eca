"""``python -m benchmarks.gpu``: what a device does beside what it could do, printed as JSON.

Within six minutes: the fast numeric tests on the device, its limits, and the time of each case,
with the share of the limit that it is measured against. On a CPU sizes are tiny by default.
"""

import dataclasses
import datetime
import os
import re
import statistics
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any, Literal

import tyro

from experiments.runner.machine import describe
from experiments.runner.report import to_json, write

# Numbers against oracles: the basis, projections, shading, the sky, near lights.
TESTS = (
    *("harmonics/test_basis.py", "harmonics/test_products.py", "harmonics/test_rotation.py"),
    *("sphere/test_projection.py", "sphere/test_lat_long.py", "transfer/test_diffuse.py"),
    *("transfer/test_glossy.py", "sky/test_preetham.py", "midrange/test_polygon.py"),
)
_ROUND = 0.02  # seconds of calls that are timed together, so that the device is kept busy
ROOT = Path(__file__).resolve().parents[1]


@dataclasses.dataclass(frozen=True)
class Options:
    """What a device does beside what it could do."""

    sizes: Literal["auto", "full", "tiny"] = "auto"
    """auto: full but on a CPU"""
    vertices: tuple[int, ...] = ()
    """of the frames; none: those of the sizes"""
    seconds: float = 340.0
    """what has not begun by then is left out, and said"""
    at_most: float = 355.0
    """when it ends whatever it does, with what there is"""
    test_seconds: float = 110.0
    """of the tests among them; 0: none"""
    tests: tuple[str, ...] = TESTS
    """files of tests, or tests, below tests/"""
    rounds: int = 5
    """of each case; the median counts"""
    only: str = ""
    """a regular expression: the cases whose name has it"""
    out: Path = Path("results/gpu.json")
    """written after each case too, so that nothing is lost"""


def run(options: Options) -> dict[str, Any]:
    """Measure, and return all of it."""
    start = time.monotonic()
    # What would fail after minutes fails here.
    wanted = re.compile(options.only)
    options.out.parent.mkdir(parents=True, exist_ok=True)
    report: dict[str, Any] = {"date": datetime.datetime.now(datetime.UTC).isoformat("T", "seconds")}
    # First, in a process of their own: two would share the device's memory.
    report["tests"] = _tests(options) if options.test_seconds and options.tests else None
    report |= {"cases": (done := []), "left_out": (left_out := [])}
    left = options.at_most - (time.monotonic() - start)
    watch = threading.Timer(max(left, 0), _give_up, (report, options.out))
    watch.daemon = True
    watch.start()
    import jax

    from . import _gpu_cases, _gpu_limits

    report |= {"machine": describe()} | {"jax": _facts()}
    tiny = options.sizes == "tiny" or (options.sizes == "auto" and jax.default_backend() == "cpu")
    sizes = _gpu_cases.TINY if tiny else _gpu_cases.FULL
    if options.vertices:
        sizes = sizes._replace(vertices=options.vertices, tiled=min(sizes.tiled, *options.vertices))
    report["sizes"] = sizes._asdict()
    report["limits"] = limits = {}
    for name, probe in _gpu_limits.probes(sizes.copied, sizes.side):
        seconds, _ = _time(jax.jit(probe.function), probe.arguments, options.rounds)
        limits[name] = {"value": probe.amount / seconds, "unit": probe.unit}
    report["vendor"] = _gpu_limits.vendor(jax.devices()[0].device_kind)
    full: dict[str, Any] = {}

    def late() -> bool:
        return time.monotonic() - start > options.seconds

    for case in _all(_gpu_cases.cases(sizes), late, left_out):
        if not wanted.search(case.name):
            continue
        if late():
            left_out.append(case.name)
            continue
        done.append(row := measure(case, limits, options.rounds, full))
        if tiny:  # goals are for full sizes
            row |= {"goal": None, "reached": None}
        print(_line(row), file=sys.stderr, flush=True)
        report["seconds"] = time.monotonic() - start
        write(options.out, to_json(report))
    watch.cancel()
    if not done and not left_out:
        left_out.append(f"all: no case has {options.only!r} in its name")
    report["seconds"] = time.monotonic() - start
    write(options.out, to_json(report))
    return report


def _give_up(report: dict[str, Any], out: Path) -> None:
    """Ends the process: a compiler cannot be told to stop."""
    try:
        report["left_out"].append("all after the last case: the time was over")
        said = to_json(dict(report))
        write(out, said)
        print(said, flush=True)
    finally:
        os._exit(1)


def _all(groups, late: Callable[[], bool], left_out: list[str]) -> Iterator[Any]:
    """The cases of all groups; one that cannot be made is said and does not end the others."""
    for group in groups:
        if late():
            left_out.append(f"{group.func.__name__.strip('_')} {group.args}")
            continue
        try:
            yield from group()
        except Exception as error:
            left_out.append(f"{group.func.__name__.strip('_')} {group.args}: {_sentence(error)}")


def measure(
    case, limits: dict[str, dict], rounds: int, full: dict[str, Any] | None = None
) -> dict[str, Any]:
    """Compile a case, time it, and set it beside the limit; an error is a row too.

    `full` keeps colors in full precision, beside which those in TF32 are set.
    """
    import jax

    row: dict[str, Any] = {"case": case.name, "precision": case.precision}
    try:
        with jax.default_matmul_precision(case.switch):
            call, compiling = case.function, None
            if case.compiled:
                began = time.perf_counter()
                call = jax.jit(case.function).lower(*case.arguments).compile()
                compiling = time.perf_counter() - began
                row |= _counted(call)
            seconds, results = _time(call, case.arguments, rounds)
            finite = all(bool(jax.numpy.isfinite(x).all()) for x in jax.tree.leaves(results))
    except Exception as error:
        return row | {"error": _sentence(error)}
    if full is not None and case.unit == "vertices":
        if case.name in full:
            row["rms_off_full"] = _rms_off(results, full.pop(case.name))
        else:
            full[case.name] = results
    row |= {"seconds": seconds, "compile_seconds": compiling, "finite": finite}
    row |= {"rate": case.items / seconds, "unit": f"{case.unit}/s"}
    row |= {"traffic_bytes": case.traffic, "operations": case.operations}
    if case.traffic:
        row["share_of_copy"] = case.traffic / seconds / limits["copy"]["value"]
    if case.operations:
        row["share_of_product"] = case.operations / seconds / limits[case.precision]["value"]
    if row.get("xla_operations"):
        row["xla_share_of_float32"] = row["xla_operations"] / seconds / limits["float32"]["value"]
    amount = case.traffic if limits[case.limit]["unit"] == "B/s" else case.operations
    if amount:
        row |= {"limit": case.limit, "share": amount / seconds / limits[case.limit]["value"]}
        row |= {"goal": case.goal, "reached": case.goal and row["share"] >= case.goal}
    return row


def _time(call: Callable[..., Any], arguments: tuple, rounds: int) -> tuple[float, Any]:
    """Seconds of a call, and its value: the median of rounds that wait for their last alone."""
    import jax

    def burst(count: int) -> tuple[float, Any]:
        began = time.perf_counter()
        results = call(*arguments)
        for _ in range(count - 1):
            results = call(*arguments)
        jax.block_until_ready(results)
        return (time.perf_counter() - began) / count, results

    burst(1)
    once, results = burst(1)
    count = max(1, min(100, round(_ROUND / once)))
    taken = []
    for _ in range(rounds):
        del results  # two at once may not fit
        seconds, results = burst(count)
        taken.append(seconds)
    return statistics.median(taken), results


def _rms_off(colors, full) -> float:
    """Root mean square of the difference, relative to that of the colors."""
    import jax.numpy as jnp

    return float(jnp.sqrt(jnp.mean((colors - full) ** 2) / jnp.mean(full**2)))


def _counted(compiled) -> dict[str, Any]:
    """What XLA itself counts of a program. A loop's body counts once."""
    cost = compiled.cost_analysis() or {}
    memory = compiled.memory_analysis()
    return {
        "xla_operations": cost.get("flops"),
        "xla_bytes": cost.get("bytes accessed"),
        "temporary_bytes": getattr(memory, "temp_size_in_bytes", None),
    }


def _facts() -> dict[str, Any]:
    import jax

    device = jax.devices()[0]
    memory = device.memory_stats() or {}
    return {
        "devices": [str(one) for one in jax.devices()],
        "platform_version": device.client.platform_version.splitlines()[0],
        "memory_bytes": memory.get("bytes_limit"),
        "default_matmul_precision": jax.config.jax_default_matmul_precision,  # pyright: ignore[reportAttributeAccessIssue]
    }


def _tests(options: Options) -> dict[str, Any]:
    """Runs tests on the device that JAX takes by itself, and counts."""
    began = time.monotonic()
    files = [str(ROOT / "tests" / name) for name in options.tests]
    command = [sys.executable, "-m", "pytest", "-v", "-n", "0", "-p", "no:cacheprovider", *files]
    # The tests take the CPU where nothing is said; empty is said, and means JAX's own choice.
    environment = {"JAX_PLATFORMS": ""} | os.environ | {"PYTHONPATH": str(ROOT)}
    try:
        ran = subprocess.run(
            command,
            cwd=ROOT,
            env=environment,
            timeout=options.test_seconds,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
        )
        said, code = ran.stdout, ran.returncode
    except subprocess.TimeoutExpired as late:
        said, code = late.stdout or b"", None
    outcomes = re.findall(r"^(\S+::.+?) (PASSED|FAILED|ERROR|SKIPPED)", said.decode(), re.M)
    found = {state: [name for name, got in outcomes if got == state] for _, state in outcomes}
    return {
        "passed": len(found.get("PASSED", [])),
        "failed": found.get("FAILED", []) + found.get("ERROR", []),
        "skipped": len(found.get("SKIPPED", [])),
        "exit_code": code,  # None: the time was over
        "said": said.decode()[-2000:] if code else "",
        "seconds": time.monotonic() - began,
    }


def _sentence(error: Exception) -> str:
    return f"{type(error).__name__}: {str(error).strip()[:300]}"


def _line(row: dict[str, Any]) -> str:
    if "error" in row:
        return f"{row['case']}: {row['error']}"
    share = f", {row['share']:.0%} of {row['limit']}" if "share" in row else ""
    return (
        f"{row['case']} ({row['precision']}): {1e3 * row['seconds']:.3f} ms, "
        f"{row['rate']:.3g} {row['unit']}{share}"
    )


def main() -> None:
    """Print the report, and end with an error where a test failed or a case did not run."""
    report = run(tyro.cli(Options, prog="python -m benchmarks.gpu"))
    print(to_json(report))
    failed = report["tests"] and (report["tests"]["failed"] or report["tests"]["exit_code"])
    wrong = [row for row in report["cases"] if "error" in row or not row["finite"]]
    raise SystemExit(1 if failed or wrong else 0)


if __name__ == "__main__":
    main()
