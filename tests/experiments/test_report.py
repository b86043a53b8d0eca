"""The page over all results, and what it says of missing, stale and damaged ones."""

import html
import html.parser
import re

import jax
import pytest
from viewer_pages import chromium

from experiments.runner import Column, Table
from experiments.runner.registry import entries
from experiments.runner.report import to_markdown
from experiments.runner.sources import digests

PAPER = """\
title = "On Toys"
cited = "Nobody 1900"
year = 1900

[[claims]]
says = "Sums are at least <10>."
where = "§1"
what = "the sum at degree 2"
measure = "toy | degree=2 | sum"
at_least = 10
digits = 1
note = "As `sum` has it."

[[claims]]
says = "Sums are small."
where = "§2"
what = "the largest sum"
measure = "toy | | max sum"
at_most = 3
unit = "kg"

[[claims]]
says = "Draws are even."
where = "§3"
what = "a draw"
measure = "toy.second | | draw"
at_least = 0
"""


class Page(html.parser.HTMLParser):
    """Checks that tags are balanced, and collects addresses and texts."""

    def __init__(self, text: str):
        super().__init__()
        self.open, self.addresses, self.ids, self.texts = [], [], [], []
        self.feed(text)
        assert self.open == []

    def handle_starttag(self, tag, attrs):
        values = dict(attrs)
        self.addresses += [values[key] for key in ("href", "src") if key in values]
        self.ids += [values["id"]] if "id" in values else []
        if tag not in ("meta", "img", "input", "br", "wbr"):
            self.open.append(tag)

    def handle_endtag(self, tag):
        assert self.open.pop() == tag

    def handle_data(self, data):
        self.texts.append(data)


@pytest.fixture
def toy_paper(toys, monkeypatch):
    # What other tests have compiled should stay.
    monkeypatch.setattr(jax, "clear_caches", lambda: None)
    (toys.folder / "toy" / "paper.toml").write_text(PAPER)
    return toys


def report(toys, *words):
    code, stdout, stderr = toys("report", "toy", "--out", str(toys.out), *words)
    return code, stdout, stderr, toys.read("report.html"), toys.read("report.md")


def test_the_page_has_verdicts_tables_pictures_and_what_is_missing(toy_paper):
    toy_paper.run("toy")
    code, stdout, _, page, markdown = report(toy_paper)
    assert code == 0
    assert stdout.split() == [str(toy_paper.out / f"report.{kind}") for kind in ("html", "md")]
    parsed = Page(page)
    assert len(parsed.ids) == len(set(parsed.ids))
    for address in parsed.addresses:  # nothing from elsewhere
        assert address.startswith("data:") or address.removeprefix("#") in parsed.ids
    said = " ".join(" ".join(parsed.texts).split())
    for text in (
        "Sums are at least <10>. §1",
        "the sum at degree 2: at least 10.0 12.0 ✓ holds by 2.0 toy preset quick",
        "the largest sum: at most 3 kg 12 kg ✗ does not hold 4 times more toy preset quick",
        "a draw: at least 0 – ○ open no results of toy.second",
        "python -m experiments run toy --preset quick",
        "degree paper ours difference 1 – 6.00 – 2 12.50 12.00 -0.50",
        "Missing A draw Nobody 1900, table 2",
    ):
        assert text in said
    assert "stale:" not in said
    assert "| Sums are small. (§2) | the largest sum: at most 3 kg | 12 kg |" in markdown
    assert "| Nobody 1900 | 1 | 1 | 1 | 1 of 2 | 0 |" in markdown
    assert "![A dot](toy/quick/dot.png)" in markdown
    assert "- `toy.second`: A draw (Nobody 1900, table 2)" in markdown


@pytest.mark.parametrize(
    ("before", "after", "why"),
    [
        ("value.sum()", "value.sum() * 2", "the code has changed: "),
        ('"""A toy."""', '"""Another toy."""  # says the same', ""),
        ("", "", "settings of its own: --degrees 1"),
    ],
)
def test_stale_is_what_the_code_would_no_longer_give(toy_paper, before, after, why):
    toy_paper.run("toy", *(() if before else ("--degrees", "1")))
    path = toy_paper.folder / "toy" / "first.py"
    path.write_text(path.read_text().replace(before, after) if before else path.read_text())
    page = report(toy_paper)[3]
    assert (f"stale: {why}" in page) == bool(why)


def test_the_code_of_an_experiment_is_what_it_uses():
    [path] = [entry.path for entry in entries().values() if entry.name == "annen2004.figure8"]
    files = set(digests(path.with_suffix(".py")))
    assert files >= {
        "experiments/annen2004/figure8.py",
        "experiments/annen2004/plots.py",
        "experiments/runner/data.py",
        "jaxsh/harmonics/_basis.py",
        "jaxsh/midrange/_taylor.py",
        "jaxsh/geometry/_files/_ply.py",  # a mesh may come from one
    }
    others = (
        "jaxsh/viewer/",
        "jaxsh/inverse/",
        "jaxsh/imaging/_splats.py",
        "experiments/runner/cli",
    )
    assert not [name for name in files if name.startswith(others)]


def test_stale_is_what_a_changed_preset_would_not_give(toy_paper):
    toy_paper.run("toy")
    path = toy_paper.folder / "toy" / "first.toml"
    path.write_text(path.read_text().replace("[1, 2]", "[1]"))
    assert "stale: the preset has changed: degrees" in report(toy_paper)[3]


def test_all_runs_what_is_missing_and_no_more(toy_paper):
    code, _, stderr, page, _ = report(toy_paper, "--all")
    assert code == 0
    assert "[1/2] toy · quick (no results)" in stderr
    assert "[2/2] toy.second · quick (no results)" in stderr
    assert "<h3>Missing</h3>" not in page
    assert report(toy_paper, "--all")[2] == ""
    path = toy_paper.folder / "toy" / "first.toml"
    path.write_text(path.read_text().replace("[1, 2]", "[2]"))
    stderr = report(toy_paper, "--all")[2]
    assert re.search(r"\[1/1\] toy · quick \(.*degrees\); 0 s so far, about \d+ s to go", stderr)


def test_all_goes_on_where_it_was_interrupted(toy_paper):
    path = toy_paper.folder / "toy" / "second.toml"
    path.write_text(path.read_text().replace("[quick]", "[quick]\nmood = 'hasty'"))
    module = toy_paper.folder / "toy" / "first.py"
    text = module.read_text()
    haste = 'if config.mood == "hasty":\n        raise KeyboardInterrupt\n    '
    module.write_text(text.replace('context.record({"draw"', haste + 'context.record({"draw"'))
    code, _, stderr, page, _ = report(toy_paper, "--all")
    assert code == 130
    assert "goes on from here" in stderr
    assert "✓ holds" in page  # what was done before is shown
    path.write_text(path.read_text().replace("hasty", "calm"))
    code, _, stderr, *_ = report(toy_paper, "--all")
    assert code == 0
    assert "[1/1] toy.second" in stderr


def test_a_failure_does_not_keep_the_others(toy_paper):
    path = toy_paper.folder / "toy" / "first.toml"
    path.write_text(path.read_text().replace("[1, 2]", '[1, 4]\nmood = "angry"'))
    code, _, stderr, page, _ = report(toy_paper, "--all")
    assert code == 1
    assert "1 of 2 failed: toy" in stderr
    assert "last run: failed on " in page
    assert "a draw: at least 0" in page


def test_results_that_cannot_be_read_are_told_and_run_anew(toy_paper):
    toy_paper.run("toy")
    folder = toy_paper.out / "toy" / "quick"
    for file, content, why in (
        ("metrics.json", b"[{", "metrics.json is not what a run writes (Expecting"),
        ("metrics.json", b"3", "metrics.json is not what a run writes ("),
        ("environment.json", b"[]", "environment.json does not say 'status'"),
        ("environment.json", b'{"status": "complete"}', "environment.json does not say 'command'"),
        ("environment.json", b"\xff", "environment.json is not what a run writes ("),
        ("config.toml", b"quick = [", "config.toml is not what a run writes ("),
        (
            "table.md",
            b"## A\n\n| a | b |\n| --- | --- |\n| 1 |\n",
            "rows of several lengths below 'A'",
        ),
        ("table.md", None, "table.md is missing"),
    ):
        whole = (folder / file).read_bytes()
        (folder / file).unlink() if content is None else (folder / file).write_bytes(content)
        code, _, stderr, page, markdown = report(toy_paper)
        assert code == 0
        assert f"warning: {folder}: " in stderr
        assert why in stderr
        assert why in html.unescape(page)
        assert why in markdown
        (folder / file).write_bytes(whole)
    (folder / "metrics.json").write_text("")
    code, _, stderr, page, _ = report(toy_paper, "--all")
    assert code == 0
    assert "warning:" not in stderr
    assert "a draw: at least 0" in page


@pytest.mark.parametrize(
    ("words", "sentence"),
    [
        (["toyy"], "unknown experiment or paper 'toyy'; did you mean 'toy'?"),
        (["--preset", "papr"], "unknown preset 'papr'; did you mean 'paper'?"),
        (["--al", "yes"], "report: "),
    ],
)
def test_mistakes(toys, words, sentence):
    assert sentence in toys.refused("report", "--out", str(toys.out), *words)


def test_a_folder_that_cannot_be_written(toys):
    toys.out.write_text("a file")
    code, _, stderr = toys("report", "toy", "--out", str(toys.out))
    assert code == 2
    assert "error: cannot write to" in stderr


@pytest.mark.parametrize(
    ("line", "sentence"),
    [
        ("at_least = 10", "toy/paper.toml: 'Sums are at least <10>.' has neither at_least nor"),
        ("measure = ", "toy/paper.toml: 'Sums are at least <10>.': Claim"),
        ("title = ", "toy/paper.toml: Paper"),
    ],
)
def test_claims_that_say_too_little(toys, line, sentence):
    path = toys.folder / "toy" / "paper.toml"
    lines = PAPER.splitlines()
    number = next(i for i, one in enumerate(lines) if one.startswith(line))
    path.write_text("\n".join(lines[:number] + lines[number + 1 :]))
    assert sentence in toys.refused("report", "--out", str(toys.out))
    path.write_text(PAPER.replace("at_least = 10", "at_lest = 10"))
    assert "unknown key 'at_lest'; did you mean 'at_least'?" in toys.refused("report")
    path.write_text(PAPER.replace("at_least = 10", "at_least = '10'"))
    assert "at_least should be a number, not '10'" in toys.refused("report")
    path.write_text(PAPER.replace("toy.second", "toy.secnd"))
    assert "toy/paper.toml: unknown experiment 'toy.secnd'" in toys.refused("report")


@pytest.mark.slow
@pytest.mark.skipif(chromium() is None, reason="needs Chromium, which is not here")
def test_in_a_browser_the_page_fits_and_shows_the_rest_on_demand(toy_paper, browser):
    toy_paper.run("toy")
    table = toy_paper.out / "toy" / "quick" / "table.md"
    columns = [Column("name", "name"), *(Column(f"x{i}", f"a long heading {i}") for i in range(9))]
    rows = [{"name": f"row {n}"} | {f"x{i}": n * i for i in range(9)} for n in range(20)]
    table.write_text(f"# toy\n\n{to_markdown(Table('Wide', columns, note='A note.'), rows)}")
    report(toy_paper)
    asked = []
    for width in (1280, 390):
        page = browser.new_page(viewport={"width": width, "height": 800})
        page.on("request", lambda one: asked.append(one.url))
        page.goto((toy_paper.out / "report.html").as_uri())
        assert page.evaluate("document.documentElement.scrollWidth") == width
        wide = page.locator(".part table")
        assert wide.locator("thead th:visible").count() == 6
        assert wide.locator("tbody tr:visible").count() == 12
        page.get_by_text("all 10 columns, all 20 rows").click()
        assert wide.locator("thead th:visible").count() == 10
        assert wide.locator("tbody tr:visible").count() == 20
        assert page.evaluate("document.documentElement.scrollWidth") == width
        assert not page.get_by_text("A note.").is_visible()
        page.close()
    assert {url.partition(":")[0] for url in asked} <= {"file", "data"}
    assert len([url for url in asked if url.startswith("file:")]) == 2
