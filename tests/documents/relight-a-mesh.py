"""The file with a texture that the page reads."""

from pathlib import Path

from experiments.surfaces.textured_mesh import write_glb

write_glb(Path("statue.glb"), 4_000, 256)
