"""The widget in a real JupyterLab on this machine: one change of light through kernel and page.

Needs jupyterlab beside what `test_browser.py` needs: `pip install --group lab`. Skipped without.
"""

import json
import os
import socket
import subprocess
import sys
import time
import urllib.request
from pathlib import Path

import pytest
import viewer_pages as pages
from test_browser import CHROMIUM, colors, levels

from jaxsh import transfer

pytest.importorskip("jupyterlab", reason="needs the package jupyterlab (pip install --group lab)")
pytest.importorskip("anywidget", reason="needs the package anywidget")
pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(CHROMIUM is None, reason="needs Chromium, which is not here"),
]
TOKEN = "viewer"
CELLS = (
    f"import sys; sys.path.insert(0, {str(Path(__file__).parent)!r})\n"
    "import viewer_pages as pages\n"
    "from jaxsh import viewer\n"
    "mesh, made, light, albedo = pages.example()\n"
    "shown = viewer.view(made, light, mesh.faces, albedo, exposure=1.5)\n"
    "shown",
    "shown.light = 0.5 * light",
)


@pytest.fixture(scope="module")
def address(tmp_path_factory):
    """Of a notebook in a JupyterLab that listens on loopback alone, and knows no settings."""
    folder = tmp_path_factory.mktemp("lab")
    cells = [
        {
            "cell_type": "code",
            "id": f"cell{i}",
            "source": source,
            "metadata": {},
            "outputs": [],
            "execution_count": None,
        }
        for i, source in enumerate(CELLS)
    ]
    kernel = {"name": "python3", "display_name": "Python 3", "language": "python"}
    notebook = {
        "cells": cells,
        "metadata": {"kernelspec": kernel},
        "nbformat": 4,
        "nbformat_minor": 5,
    }
    (folder / "knot.ipynb").write_text(json.dumps(notebook))
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        port = free.getsockname()[1]
    names = ("JUPYTER_CONFIG_DIR", "JUPYTER_DATA_DIR", "JUPYTER_RUNTIME_DIR", "IPYTHONDIR")
    own = {name: str(folder / name.lower()) for name in names}
    options = ("--no-browser", "--allow-root", "--ip=127.0.0.1", f"--port={port}")
    said = folder / "log.txt"
    with said.open("w") as log:
        server = subprocess.Popen(
            [
                *(sys.executable, "-m", "jupyterlab", *options, "--ServerApp.port_retries=0"),
                *(f"--IdentityProvider.token={TOKEN}", f"--ServerApp.root_dir={folder}"),
            ],
            env=os.environ | own,
            stdout=log,
            stderr=log,
        )
    site = f"http://127.0.0.1:{port}"
    try:
        for _ in range(240):
            assert server.poll() is None, said.read_text()
            try:
                urllib.request.urlopen(f"{site}/api?token={TOKEN}").close()
                break
            except OSError:
                time.sleep(0.5)
        yield f"{site}/lab/tree/knot.ipynb?token={TOKEN}"
    finally:
        server.terminate()  # and its kernels
        server.wait(30)


def test_a_cell_relights_what_another_shows(browser, address):
    _, made, light, albedo = pages.example()
    window = browser.new_context(viewport={"width": 1280, "height": 900})
    page = window.new_page()
    page.set_default_timeout(120_000)
    faults = []
    site = address.split("/lab")[0]
    own = (site, site.replace("http", "ws"), "data:", "blob:")
    page.on("request", lambda one: one.url.startswith(own) or faults.append(one.url))
    page.goto(address)
    # Once the kernel is there, cells run as they are asked to.
    page.locator(".jp-Notebook-ExecutionIndicator[data-status='idle']").first.wait_for()
    page.locator(".jp-Notebook .cm-content").first.click()
    page.keyboard.press("Shift+Enter")
    page.locator(".jaxsh canvas").first.wait_for()
    page.evaluate("globalThis.viewer = document.querySelector('.jaxsh').viewer")
    shaded = transfer.shade_diffuse(light, made, albedo)
    assert abs(levels(colors(page)) - levels(shaded)).max() < 0.1
    page.evaluate("globalThis.before = viewer.lights[0][0][0]")
    page.keyboard.press("Shift+Enter")
    page.wait_for_function("viewer.lights[0][0][0] === before / 2")
    assert abs(levels(colors(page)) - levels(0.5 * shaded)).max() < 0.1
    assert page.locator(".jaxsh").bounding_box()["height"] == 480
    assert page.locator(".jaxsh").bounding_box()["width"] > 600
    window.close()
    assert faults == []
