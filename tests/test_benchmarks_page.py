"""docs/benchmarks.md is what `python -m benchmarks.page` makes of the rows that were measured."""

import json

from benchmarks import page


def test_the_page_is_made_of_the_rows():
    rows, ran = (
        json.loads((page.MEASURED / name).read_text("utf-8"))
        for name in ("rows.json", "environment.json")
    )
    assert (page.ROOT / "docs" / "benchmarks.md").read_text("utf-8") == page.page(rows, ran)
    assert rows["basis"][0]["quantity"] == "values"
