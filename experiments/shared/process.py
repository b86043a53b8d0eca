"""What this process may use, and has used."""

import contextlib
import math
import os
from pathlib import Path


def cores() -> int:
    """The cores that this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def peak_gigabytes(fresh: bool = False) -> float:
    """The largest memory that this process has held (Linux; else what it holds now, by psutil).

    `fresh` starts anew from what it holds now. NaN where neither is to be had.
    """
    with contextlib.suppress(OSError):
        if fresh:
            Path("/proc/self/clear_refs").write_text("5")
        lines = Path("/proc/self/status").read_text().splitlines()
        return float(next(line for line in lines if line.startswith("VmHWM")).split()[1]) / 1e6
    try:
        import psutil
    except ImportError:  # only bakes on a cluster bring it along
        return math.nan
    return psutil.Process().memory_info().rss / 1e9
