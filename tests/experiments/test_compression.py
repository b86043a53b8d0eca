"""The experiment `sloan2003.compression` end to end on the embedded data, small."""

import pytest
from runs import run


@pytest.mark.slow
def test_clusters_are_smaller_and_near(tmp_path):
    options = "--degree", "2", "--directions", "64", "--rounds", "1", "--sizes", "2", "4", "4", "6"
    folder, rows = run(tmp_path, "sloan2003.compression", *options, small=True)
    rows = {row["form"]: row for row in rows}
    assert list(rows) == ["all", "float16", "eight bits", "samples", "2 × 4", "4 × 6"]
    assert (rows["all"]["bytes"], rows["all"]["diffuse_error"]) == (36, 0)
    assert (rows["float16"]["bytes"], rows["eight bits"]["bytes"]) == (18, 9)
    assert rows["samples"]["glossy_error"] < 1e-3
    # 4 weights and a cluster; what 2 clusters of 5 rows of 9 codes and a scale take.
    assert rows["2 × 4"]["bytes"] == pytest.approx(5 + 2 * 5 * (2 * 9 + 4) / 400, rel=0.05)
    for kind in ("diffuse", "glossy"):
        assert 25 > rows["2 × 4"][f"{kind}_error"] > rows["4 × 6"][f"{kind}_error"] > 0
        assert rows["2 × 4"][f"{kind}_ms"] > 0
    assert "glossy_ms" not in rows["eight bits"]
    assert (folder / "bytes.png").is_file()
