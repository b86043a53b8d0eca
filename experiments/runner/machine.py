"""What a run ran on: the context without which its numbers say little."""

import functools
import importlib.metadata
import os
import platform
import subprocess
from pathlib import Path
from typing import Any

_PACKAGES = (
    *("jaxsh", "jax", "jaxlib", "numpy", "scipy", "equinox", "optimistix", "lineax", "jaxopt"),
    *("trimesh", "embreex", "matplotlib", "OpenImageIO"),
)


def describe() -> dict[str, Any]:
    """Versions, machine, device and commit, for ``environment.json``."""
    import jax

    device = jax.devices()[0]
    changes = _git("status", "--porcelain")
    return {
        "python": platform.python_version(),
        "versions": {name: _version(name) for name in _PACKAGES},
        "platform": platform.platform(),
        "cpu": {"model": _cpu_model(), "count": _cpu_count()},
        "device": {
            "platform": device.platform,
            "kind": device.device_kind,
            "count": jax.device_count(),
        },
        "commit": _git("rev-parse", "HEAD"),
        "dirty": None if changes is None else bool(changes),
    }


@functools.cache
def compile_clock() -> list[float]:
    """The seconds that JAX has spent tracing, lowering and compiling since the first call."""
    import jax.monitoring

    clock = [0.0]

    def listen(event: str, duration_secs: float, **_: Any) -> None:
        if event.startswith("/jax/core/compile/"):
            clock[0] += duration_secs

    jax.monitoring.register_event_duration_secs_listener(listen)
    return clock


def _version(package: str) -> str | None:
    try:
        return importlib.metadata.version(package)
    except importlib.metadata.PackageNotFoundError:
        return None


def _cpu_model() -> str:
    models = Path("/proc/cpuinfo")  # Linux; elsewhere platform knows
    if models.exists():
        for line in models.read_text().splitlines():
            if line.startswith("model name"):
                return line.partition(":")[2].strip()
    return platform.processor() or platform.machine()


def _cpu_count() -> int:
    """The cores that this process may use."""
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


def _git(*arguments: str) -> str | None:
    """Git's answer about this checkout; None where there is no git or no checkout."""
    command = ["git", "-C", str(Path(__file__).parent), *arguments]
    try:
        return subprocess.run(command, capture_output=True, text=True, check=True).stdout.strip()
    except (OSError, subprocess.CalledProcessError):
        return None
