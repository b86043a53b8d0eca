"""Let other packages evaluate coefficients, for the tests of `harmonics.convert`.

    python -m venv references && . references/bin/activate && cd references
    pip install pyshtools e3nn-jax sphericart scipy torch gsplat
    npm install three @babylonjs/core filament
    git clone --depth 1 https://github.com/microsoft/DirectXMath
    git clone --depth 1 https://github.com/NVIDIAGameWorks/kaolin
    python ../tools/make_convention_references.py .

writes `tests/harmonics/convention_references.json`: for each convention, coefficients in the
package's own layout, directions in its own axes, and what its own function makes of them there,
with the package's version. jaxsh takes no part in it. A C++ compiler and Node.js are needed.
"""

# The packages live in an environment of their own.
# pyright: reportMissingImports=false

import argparse
import json
import runpy
import subprocess
import tempfile
from importlib.metadata import version
from pathlib import Path

import numpy as np

TARGET = Path(__file__).parents[1] / "tests/harmonics/convention_references.json"
RNG = np.random.default_rng(16)
DEGREE, COUNT = 4, 5

_NODE = """
import {{ readFileSync }} from "node:fs";
import {{ createRequire }} from "node:module";
import {{ Vector3, SphericalHarmonics3 }} from "three";
import {{ Vector3 as Vector, Color3 }} from "@babylonjs/core/Maths/math.js";
import {{ SphericalHarmonics }} from "@babylonjs/core/Maths/sphericalPolynomial.js";

const given = JSON.parse(readFileSync("{given}"));
const found = {{ radiance: [], irradiance: [], lights: [], gltf: [], filament: [] }};
globalThis.self = globalThis;
const filament = await createRequire(import.meta.url)("filament/filament.js")({{}});
const sh = new SphericalHarmonics3().fromArray(given.coefficients.flat());
const harmonics = SphericalHarmonics.FromArray(given.coefficients);
harmonics.convertIrradianceToLambertianRadiance();
harmonics.preScaleForRendering();
const names = ["l00", "l1_1", "l10", "l11", "l2_2", "l2_1", "l20", "l21", "l22"];
for (const [x, y, z] of given.directions) {{
    const normal = new Vector3(x, y, z);
    found.radiance.push(sh.getAt(normal, new Vector3()).toArray());
    found.irradiance.push(sh.getIrradianceAt(normal, new Vector3()).toArray());
    // It takes where the light goes, and gives the color over its largest part, and that part.
    const [r, g, b, most] = filament.IndirectLight.getColorEstimate(
        given.coefficients.flat(), [-x, -y, -z]);
    found.filament.push([r * most, g * most, b * most]);
    const light = new SphericalHarmonics();
    light.addLight(new Vector(x, y, z), new Color3(1, 2, 3), 1);
    found.lights.push(names.map((name) => light[name].asArray()));
    // The sum that the shader makes of coefficients scaled for rendering.
    const terms = [1, y, z, x, x * y, y * z, 3 * z * z - 1, z * x, x * x - y * y];
    const scaled = names.map((name) => harmonics[name].asArray());
    found.gltf.push([0, 1, 2].map((c) => terms.reduce((s, t, i) => s + t * scaled[i][c], 0)));
}}
console.log(JSON.stringify(found));
process.exit(0);
"""


_CPP = """
#include <cstdio>
#include "DirectXSH.h"

int main() {
    float x, y, z, result[36];
    while (std::scanf("%f %f %f", &x, &y, &z) == 3) {
        DirectX::XMSHEvalDirection(result, 6, DirectX::XMVectorSet(x, y, z, 0.0f));
        for (float value : result) std::printf("%.9g ", value);
        std::printf("\\n");
    }
}
"""


def directions():
    vectors = RNG.normal(size=(COUNT, 3))
    return vectors / np.linalg.norm(vectors, axis=-1, keepdims=True)


def entry(package, function, coefficients, at, values, **more):
    arrays = {"coefficients": coefficients, "directions": at, "values": values}
    said = {name: np.asarray(array).tolist() for name, array in arrays.items()}
    package = package if " " in package else f"{package} {version(package)}"
    return {"package": package, "function": function, **said, **more}


def of_pyshtools():
    import pyshtools

    at = directions()
    latitude = np.degrees(np.arcsin(at[:, 2]))
    longitude = np.degrees(np.arctan2(at[:, 1], at[:, 0]))
    for normalization in ("4pi", "ortho", "schmidt", "unnorm"):
        for phase, said in ((1, "none"), (-1, "condon-shortley")):
            given = RNG.normal(size=(2, DEGREE + 1, DEGREE + 1))
            given *= np.tri(DEGREE + 1)
            given[1, :, 0] = 0
            made = pyshtools.SHCoeffs.from_array(given, normalization=normalization, csphase=phase)
            values = made.expand(lat=latitude, lon=longitude)
            function = f"SHCoeffs.expand, csphase={phase}"
            name = f"pyshtools-{normalization}"
            yield name, entry("pyshtools", function, given, at, values, facts={"phase": said})


def of_e3nn():
    import e3nn_jax
    import jax

    jax.config.update("jax_enable_x64", True)
    for normalization in ("component", "integral", "norm"):
        at, given = directions(), RNG.normal(size=(DEGREE + 1) ** 2)
        basis = e3nn_jax.spherical_harmonics(
            e3nn_jax.s2_irreps(DEGREE), at, True, normalization=normalization
        )
        values = np.asarray(basis.array) @ given
        yield f"e3nn-{normalization}", entry("e3nn-jax", "spherical_harmonics", given, at, values)


def of_sphericart():
    import sphericart

    at, given = directions(), RNG.normal(size=(DEGREE + 1) ** 2)
    values = sphericart.SphericalHarmonics(DEGREE).compute(at) @ given
    yield "sphericart", entry("sphericart", "SphericalHarmonics.compute", given, at, values)


def of_scipy():
    from scipy.special import sph_harm_y

    at, given = directions(), RNG.normal(size=(DEGREE + 1) ** 2)
    theta, phi = np.arccos(at[:, 2]), np.arctan2(at[:, 1], at[:, 0])
    values = np.zeros(COUNT)
    for l in range(DEGREE + 1):
        for m in range(-l, l + 1):
            complex_ = sph_harm_y(l, abs(m), theta, phi)
            part = complex_.imag if m < 0 else complex_.real
            values += given[l * (l + 1) + m] * part * (np.sqrt(2) if m else 1)
    function = "real and imaginary part of sph_harm_y, times √2"
    yield "condon-shortley", entry("scipy", function, given, at, values)


def of_gsplat():
    import torch
    from gsplat.cuda._torch_impl import _spherical_harmonics

    at, given = directions(), RNG.normal(size=(25, 3))
    repeated = torch.tensor(given).expand(COUNT, 25, 3)
    values = _spherical_harmonics(4, torch.tensor(at), repeated)
    yield "gaussian-splatting", entry("gsplat", "_spherical_harmonics", given, at, values)


def of_kaolin(folder: Path):
    import torch

    # The one file: the package itself wants to be built for a GPU.
    space = runpy.run_path(str(folder / "kaolin/kaolin/render/lighting/sh.py"))
    at, given = directions(), RNG.normal(size=9)
    values = space["project_onto_sh9"](torch.tensor(at)) @ torch.tensor(given)
    both = {"package": cloned(folder, "kaolin"), "coefficients": given, "at": at}
    yield "kaolin", entry(function="project_onto_sh9", values=values, **both)
    values = space["sh9_irradiance"](torch.tensor(given), torch.tensor(at))
    yield "kaolin", entry(function="sh9_irradiance", values=values, quantity="irradiance", **both)


def of_directxmath(folder: Path):
    at, given = directions(), RNG.normal(size=36)
    source = folder / "DirectXMath"
    with tempfile.TemporaryDirectory() as scratch:
        made = Path(scratch)
        plain = ["_In_", "_Out_", "_Out_opt_", "_Inout_", "_Use_decl_annotations_"]
        called = "_In_reads_ _In_reads_bytes_ _Out_writes_ _Out_writes_opt_ _Out_writes_bytes_"
        called = [f"{name}(x)" for name in [*called.split(), "_Analysis_assume_", "_Success_"]]
        # Microsoft's annotations mean nothing to other compilers.
        (made / "sal.h").write_text("\n".join(f"#define {name}" for name in plain + called))
        (made / "main.cpp").write_text(_CPP)
        include = [f"-I{made}", f"-I{source / 'Inc'}", f"-I{source / 'SHMath'}"]
        sources = [made / "main.cpp", source / "SHMath/DirectXSH.cpp"]
        subprocess.run(
            ["g++", "-std=c++14", "-w", *include, *sources, "-o", made / "main"], check=True
        )
        lines = "\n".join(" ".join(map(repr, row)) for row in at.tolist())
        run = subprocess.run(
            [made / "main"], input=lines, check=True, capture_output=True, text=True
        )
    basis = np.array([line.split() for line in run.stdout.splitlines()], float)
    yield (
        "directxmath",
        entry(cloned(folder, "DirectXMath"), "XMSHEvalDirection", given, at, basis @ given),
    )


def cloned(folder: Path, name: str) -> str:
    command = ["git", "-C", folder / name, "log", "-1", "--format=%h of %cs"]
    return f"{name} " + subprocess.check_output(command, text=True).strip()


def of_node(folder: Path):
    given, at = RNG.normal(size=(9, 3)), directions()
    given[0] += 9  # Filament's estimate wants positive light
    with tempfile.TemporaryDirectory(dir=folder) as scratch:
        data, script = Path(scratch, "given.json"), Path(scratch, "evaluate.mjs")
        data.write_text(json.dumps({"coefficients": given.tolist(), "directions": at.tolist()}))
        script.write_text(_NODE.format(given=data))
        run = subprocess.run(["node", script], check=True, capture_output=True, text=True)
    found = json.loads(run.stdout)
    said = {}
    for package in ("three", "@babylonjs/core", "filament"):
        facts = json.loads((folder / "node_modules" / package / "package.json").read_text())
        said[package] = f"{package} {facts['version']}"

    def made(name, package, function, values, **more):
        return name, entry(said[package], function, given, at, values, **more)

    yield made("three.js", "three", "SphericalHarmonics3.getAt", found["radiance"])
    yield made(
        "three.js",
        "three",
        "SphericalHarmonics3.getIrradianceAt",
        found["irradiance"],
        quantity="irradiance",
    )
    yield made(
        "gltf",
        "@babylonjs/core",
        "SphericalHarmonics, as the glTF loader prepares them",
        found["gltf"],
        quantity="irradiance/pi",
    )
    yield made(
        "filament",
        "filament",
        "IndirectLight.getColorEstimate",
        found["filament"],
        quantity="irradiance",
    )
    # Light from one direction, whose coefficients are the basis there.
    yield made(
        "babylon.js", "@babylonjs/core", "SphericalHarmonics.addLight", [], lights=found["lights"]
    )


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("folder", type=Path, help="with node_modules and the clones")
    folder = parser.parse_args().folder.resolve()
    sources = [of_pyshtools(), of_e3nn(), of_sphericart(), of_scipy(), of_gsplat()]
    sources += [of_kaolin(folder), of_directxmath(folder), of_node(folder)]
    entries = [{"convention": name, **facts} for source in sources for name, facts in source]
    lines = ",\n".join(json.dumps(one, ensure_ascii=False) for one in entries)
    TARGET.write_text(f"[\n{lines}\n]\n", encoding="utf-8")


if __name__ == "__main__":
    main()
