"""The hooks of the documentation: what they refuse of a site, and the formulas they set."""

import json

import pytest

checks = pytest.importorskip("checks", reason="mkdocs is not installed: its hooks are not tried")
formulas = pytest.importorskip("formulas", reason="latex2mathml is not installed")


@pytest.fixture
def site(tmp_path):
    """A site without fault."""
    (tmp_path / "search").mkdir()
    words = {"title": "A tutorial", "text": "<p>Gaussian splats, Unity, <b>three.js</b></p>"}
    more = {"title": "torch", "text": "a texture; multi-`gpu` or TPU."}
    large = {"title": "Out of core", "text": "What memory cannot hold, by a cluster of Dask."}
    index = {"config": {"separator": r"[\s\-_,:/`]+"}, "docs": [words, more, large]}
    (tmp_path / "search" / "search_index.json").write_text(json.dumps(index))
    (tmp_path / "a.html").write_text('<h2 id="there">A</h2><a href="b.html">b</a><img src="p.png">')
    (tmp_path / "b.html").write_text(
        '<a href="a.html#there">a</a><a href="https://else.where">e</a>'
    )
    (tmp_path / "p.png").touch()
    return tmp_path


def said(site, caplog):
    caplog.clear()
    checks.on_post_build({"site_dir": str(site)})
    return [record.getMessage() for record in caplog.records]


def test_a_site_without_fault_passes(site, caplog):
    assert said(site, caplog) == []


@pytest.mark.parametrize(
    ("page", "fault"),
    [
        ('<a href="gone.html">', "gone.html leads nowhere"),
        ('<a href="a.html#gone">', "a.html#gone has no such anchor"),
        ('<img src="gone.png">', "gone.png leads nowhere"),
        ('<script src="https://cdn.example/x.js">', "https://cdn.example/x.js is on the network"),
        ('<a href="../outside.html">', "../outside.html leads nowhere"),
    ],
)
def test_faults_of_links_are_said(site, caplog, page, fault):
    (site / "c.html").write_text(page)
    assert said(site, caplog) == [f"c.html: {fault}"]


def test_words_that_the_search_misses_are_said(site, caplog):
    index = site / "search" / "search_index.json"
    index.write_text(index.read_text().replace("Dask", "task").replace("three.js", "three"))
    assert said(site, caplog) == [f"the search does not find {w!r}" for w in ("three.js", "dask")]


def test_formulas_become_mathml():
    rows = r"\begin{aligned} a &amp;= 1 \\ b &amp;&lt; 2 \end{aligned}"
    shown = formulas.on_page_content(
        r'<p><span class="arithmatex">\(\lvert s\rvert/r\)</span> and</p>'
        rf'<div class="arithmatex">\[{rows}\]</div>'
    )
    assert shown.count("<math ") == 2
    assert shown.count("</math>") == 2
    assert shown.count("<mtr>") == 2
    assert r"\l" not in shown
    assert "arithmatex" not in shown
