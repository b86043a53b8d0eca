"""docs/benchmarks.md is what `python -m benchmarks.page` makes of the rows that were measured."""

from benchmarks import _sections, page


def test_the_page_is_made_of_the_rows():
    rows, ran = page.measured()
    assert (page.ROOT / "docs" / "benchmarks.md").read_text("utf-8") == page.page(rows, ran)
    assert tuple(rows) == _sections.NAMES


def test_every_section_with_rows_has_its_plot():
    rows, _ = page.measured()
    drawn = {name for name in rows if _sections.load(name).draw and rows[name]}
    images = page.ROOT / "docs" / "images"
    assert {path.stem for path in images.glob("benchmarks_*.png")} == {
        f"benchmarks_{name}" for name in drawn
    }
