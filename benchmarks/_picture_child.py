"""README's example up to its first picture, in a process of its own: what each part takes.

``python benchmarks/_picture_child.py START``, START the time before the process began. A file and
no module of the package, so that `PYTHONPATH` says which jaxsh it is about.
"""

import contextlib
import json
import os
import sys
import tempfile
import time

BEGAN = time.time()
PROGRAMS: list[str] = []
ROWS: list[dict] = []


@contextlib.contextmanager
def part(name: str):
    """Add what happens inside as a row, with the seconds before the process ran in the first."""
    programs = len(PROGRAMS)
    start = time.perf_counter(), time.process_time()
    yield
    ROWS.append(
        {
            "part": name,
            "wall_s": time.perf_counter() - start[0],
            "cpu_s": time.process_time() - start[1],
            "programs": len(PROGRAMS) - programs,
        }
    )


def main(start: float) -> None:
    ROWS.append({"part": "python", "wall_s": BEGAN - start, "cpu_s": 0.0, "programs": 0})
    with part("import jax"):
        import jax
        import jax.monitoring

    def compiled(event: str, duration_secs: float, **about) -> None:
        # With the persistent cache it is what the cache gives back.
        if event == "/jax/core/compile/backend_compile_duration":
            PROGRAMS.append(event)

    jax.monitoring.register_event_duration_secs_listener(compiled)
    with part("import jaxsh"):
        from jaxsh import geometry, imaging, sphere, transfer
    with part("knot"):
        mesh = geometry.knot()
    with part("studio"):
        probe = imaging.studio()
    with part("split_sun"):
        suns, rest = sphere.split_sun(probe)
    with part("project_lat_long"):
        light = sphere.project_lat_long(rest, degree=6)
    with part("bake"):
        baked = transfer.bake(mesh, degree=6, directions=512, progress=False)
    with part("shade_diffuse"):
        radiance = transfer.shade_diffuse(light, baked, albedo=0.5).block_until_ready()
    with part("shade_sun"):
        lit = transfer.shade_sun(suns, mesh, albedo=0.5)
        radiance = (radiance + lit).block_until_ready()
    with part("Camera.facing"):
        camera = imaging.Camera.facing(mesh)
    with part("rasterize"):
        raster = imaging.rasterize(mesh, camera, samples=3)
    with part("backdrop"):
        behind = imaging.backdrop(probe, camera).block_until_ready()
    with part("interpolate"):
        image = imaging.interpolate(raster, radiance, behind).block_until_ready()
    with part("tone_map"):
        exposure = imaging.auto_exposure(image, raster.mask)
        shown = imaging.tone_map(image, exposure).block_until_ready()
    with part("write_image"), tempfile.TemporaryDirectory() as folder:
        imaging.write_image(os.path.join(folder, "knot.png"), shown)
    print(json.dumps(ROWS))


if __name__ == "__main__":
    main(float(sys.argv[1]))
