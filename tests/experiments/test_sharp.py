"""The experiment `sharp` end to end on the embedded data, small."""

import pytest
from pictures import assert_picture
from runs import run

SMALL = {
    "degrees": [1, 4],
    "counts": [1],
    "scan-counts": [1],
    "exponents": [8],
    "rays": [16],
    "directions": [64],
    "vertices": [50],
    "size": [40],
    "picture-directions": [64],
}


@pytest.mark.slow
def test_a_sun_split_off_is_worth_it(tmp_path):
    options = [word for name, values in SMALL.items() for word in (f"--{name}", *map(str, values))]
    folder, rows = run(tmp_path, "sharp", *options, small=True)
    errors = {(r["variant"], r["count"], r["degree"]): r for r in rows if "variant" in r}
    assert len(errors) == 8
    for variant in ("unshadowed", "shadowed"):
        alone, beside = errors[variant, 0, 4], errors[variant, 1, 4]
        assert beside["error"] < alone["error"] / 3
        assert beside["glossy 8"] < alone["glossy 8"] / 3
        assert errors[variant, 1, 1]["error"] < errors[variant, 0, 1]["error"] / 3
        assert beside["reference_error"] < 0.5
        # The parts are those of the whole, and the sun's is most of the light.
        parts = beside["cut"], beside["bake"], beside["rays"]
        assert max(parts) / 3 < beside["error"] < sum(parts) + 2 * beside["reference_error"]
        assert 50 < beside["sun_light"] < 100
    scanned = {(r["scan"], r["value"]): r["scan_error"] for r in rows if "scan" in r}
    assert len(scanned) == 10
    assert scanned["threshold", 4.0] == scanned["largest", 0.1] == errors["shadowed", 1, 4]["error"]
    assert scanned["largest", 0.01] > scanned["largest", 0.1]
    for picture in ("studio.png", "thresholds.png"):
        assert_picture(folder / picture)
