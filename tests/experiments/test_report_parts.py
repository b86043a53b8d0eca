"""What the report is made of: places of numbers, verdicts on claims, tables and what to show."""

import pytest

from experiments.runner import Column, Table, UserError
from experiments.runner.claims import Claim, judge, read
from experiments.runner.places import Place
from experiments.runner.registry import entries
from experiments.runner.report import to_markdown
from experiments.runner.results import Shown, _tables, in_view

ROWS = [
    {"degree": degree, "kind": kind, "x": degree * sign}
    for degree in (1, 2, 4)
    for kind, sign in (("a", 1), ("b", -1))
]


@pytest.mark.parametrize(
    ("text", "value"),
    [
        ("e | degree=2; kind=a | x", 2),
        ("e | degree>=2; kind=b | min x", -4),
        ("e | degree<2; kind!=b | x", 1),
        ("e | kind=a | median x", 2),
        ("e | degree>1 | count x", 4),
    ],
)
def test_places(text, value):
    assert Place.read(text).value(ROWS) == value


def test_places_that_name_no_number():
    for text in ("e | degree=2 | x", "e | degree=3 | max x", "e | | y"):
        with pytest.raises(ValueError, match="rows"):
            Place.read(text).value(ROWS)
    for text in ("e | x", "e | degree | x", " | | x"):
        with pytest.raises(UserError, match="expected"):
            Place.read(text)


@pytest.mark.parametrize(
    ("bounds", "holds", "margin"),
    [
        ({"at_least": 3.0}, "holds", "by 1 m"),
        ({"at_most": 3.0}, "does not hold", "by 1 m"),
        ({"at_most": 0.04}, "does not hold", "100 times more"),
        ({"at_least": 3.0, "at_most": 9.0}, "holds", "by 1 m"),
        ({"at_least": 4.0, "preset": "paper"}, "open", "only the preset paper can tell"),
        ({"at_least": 4.0, "over": Place.read("e | degree=9 | x")}, "open", "not measured"),
        ({"at_least": -1.0, "minus": Place.read("e | kind=b | max x")}, "holds", "by 6 m"),
        ({"at_most": 2.0, "over": Place.read("e | degree=2; kind=a | x")}, "holds", "by 0 m"),
    ],
)
def test_verdicts(bounds, holds, margin):
    claim = Claim("", "", Place.read("e | kind=a | max x"), "", unit="m", **bounds)
    verdict = judge(claim, {"e": ROWS}, {"e": "quick"})
    assert verdict.holds == holds
    assert verdict.margin.startswith(margin)


def test_a_number_that_is_none_does_not_hold():
    claim = Claim("", "", Place.read("e | | x"), "", at_least=1.0)
    assert judge(claim, {"e": [{"x": "NaN"}]}, {"e": "quick"}).holds == "does not hold"


def test_claims_of_the_papers_name_experiments_and_notes_are_sentences():
    known = entries()
    for folder in {entry.path.parent for entry in known.values()}:
        for claim in read(folder).claims:
            assert set(claim.experiments) <= set(known)
            assert claim.says.endswith(".")
            assert claim.where


def test_a_table_is_read_back_as_it_was_written():
    columns = [Column("mesh", "mesh"), Column("fps", "fps: a", paper="fps_paper", digits=1)]
    rows = [{"mesh": "a|b", "fps": 2.0, "fps_paper": 1.5}, {"mesh": "c", "fps": 3.0}]
    text = to_markdown(Table("T", columns, note="Two\nlines."), rows)
    [table] = _tables(f"# head\n\n{text}\n![p](p.png)\n\n## no table\n")
    assert table == Shown(
        "T",
        ["mesh", "paper", "ours", "difference"],
        ["", "fps: a", "fps: a", "fps: a"],
        [["a|b", "1.5", "2.0", "+0.5"], ["c", "–", "3.0", "–"]],
        "Two lines.",
    )


def view(heads, groups, cells, most=6):
    shown = in_view(Shown("", heads, groups, cells, ""), most)
    return [head for head, seen in zip(heads, shown, strict=True) if seen]


def test_six_columns_in_view_tell_rows_apart_and_have_the_papers():
    heads = ["light", "mesh", "degree", *(["paper", "ours", "difference"] * 2), "a", "b"]
    groups = ["", "", "", *["vertices"] * 3, *["fps"] * 3, "", ""]
    cells = [
        [light, "knot", "4", "52", str(n), "+1", "5.4", f"{n}.5", "+0.1", "1.0", f"{n}.0"]
        for n, light in enumerate("xyz")
    ]
    # One column tells the rows apart; the paper's results, then its sizes, then what varies.
    seen = in_view(Shown("", heads, groups, cells, ""))
    assert [i for i, one in enumerate(seen) if one] == [0, 3, 4, 6, 7, 10]
    seen = in_view(Shown("", heads, groups, cells, ""), most=3)
    assert [i for i, one in enumerate(seen) if one] == [0, 6, 7]
    assert all(in_view(Shown("", heads, groups, cells, ""), most=11))


def test_numbers_tell_rows_apart_where_texts_do_not():
    heads = ["environment", "degree", "method", "size", "x", "y", "z"]
    cells = [
        ["studio", degree, method, "9", "0.1", "1.0", f"{i}.0"]
        for i, (degree, method) in enumerate((d, m) for d in "24" for m in ("tiles", "full"))
    ]
    none = [""] * 7
    assert view(heads, none, cells) == ["environment", "degree", "method", "x", "y", "z"]
    assert view(heads, none, cells, most=3) == ["degree", "method", "z"]
    assert view(heads, none, [], most=2) == ["environment", "degree"]
