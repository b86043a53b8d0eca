"""One browser for all tests that drive one."""

import pytest
import viewer_pages as pages


@pytest.fixture(scope="session")
def browser():
    """Chromium, drawing in software."""
    playwright = pytest.importorskip("playwright.sync_api", reason="needs the package playwright")
    options = ["--use-gl=angle", "--use-angle=swiftshader", "--enable-unsafe-swiftshader"]
    with playwright.sync_playwright() as started:
        launched = started.chromium.launch(
            executable_path=pages.chromium(), args=[*options, "--no-sandbox"]
        )
        yield launched
        launched.close()
