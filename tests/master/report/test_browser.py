"""Reports in a real browser: drawn, silent, sealed. Skipped where there is no Chromium."""

import re
import shutil
import subprocess

import pytest

from master.report import html_markup
from master.report.comparison_page import comparison_page
from master.report.run_page import page
from tests.effort import rest

BROWSER = next((b for b in ("chromium", "chromium-browser", "google-chrome") if shutil.which(b)), None)
needs_browser = pytest.mark.skipif(BROWSER is None, reason="no Chromium on the PATH: pages cannot be tried out")
OPTIONS = [
    "--headless",
    "--no-sandbox",
    "--disable-gpu",
    "--disable-quic",
    "--no-first-run",
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-sync",
    "--enable-logging=stderr",
    "--virtual-time-budget=15000",
]


def look_at(path, profile, *more):
    """Open a page; returns its DOM after drawing, and what it wrote on the console."""
    command = [BROWSER, *OPTIONS, f"--user-data-dir={profile}", *more, "--dump-dom", path.as_uri()]
    done = subprocess.run(command, capture_output=True, text=True, timeout=120, check=True)
    return done.stdout, [line for line in done.stderr.splitlines() if ":CONSOLE" in line]


@pytest.fixture
def page_of_run(made_up, tmp_path):
    path = tmp_path / "report.html"
    path.write_text(page(made_up()), encoding="utf-8")
    return path


#: Colour schemes by the number that the browser has for them.
DARK, LIGHT = 0, 1


@needs_browser
@pytest.mark.slow
@pytest.mark.parametrize(
    ("scheme", "size"), [(DARK, "1280,900"), (LIGHT, "420,900"), *rest((DARK, "420,900"), (LIGHT, "1280,900"))]
)
def test_every_chart_and_the_moving_picture_are_drawn(page_of_run, tmp_path, size, scheme):
    look = (f"--window-size={size}", f"--blink-settings=preferredColorScheme={scheme}")
    dom, said = look_at(page_of_run, tmp_path / "profile", *look)
    assert said == []
    wanted = page_of_run.read_text().count("class='chart'")
    assert wanted >= 9
    assert f'data-drawn="{wanted}"' in dom
    assert dom.count('class="main-svg"') >= wanted
    assert 'data-drawn="yes"' in dom  # the canvas


@needs_browser
@pytest.mark.slow
def test_the_moving_picture_plays(page_of_run, tmp_path):
    page = page_of_run.read_text()
    began = re.search(r"data-begin='([^']*)'", page)
    click = "<script>document.getElementById('movie-play').click()</script></body>"
    # a browser that shows nothing draws hardly any frames by itself
    clocked = "<script>window.requestAnimationFrame = (f) => setTimeout(() => f(performance.now()), 16)</script><main>"
    page_of_run.write_text(page.replace("<main>", clocked).replace("</body>", click))
    dom, said = look_at(page_of_run, tmp_path / "profile")
    assert said == []
    clock = float(re.search(r'id="movie-clock">([0-9.]+) s', dom)[1])
    assert clock > 2.0 * float(began[1]) + 0.2  # the made-up run takes 2 s


@needs_browser
@pytest.mark.slow
def test_comparisons_are_drawn(made_up, tmp_path):
    path = tmp_path / "comparison.html"
    path.write_text(comparison_page([made_up(folder=tmp_path / n) for n in "ab"]), encoding="utf-8")
    dom, said = look_at(path, tmp_path / "profile")
    assert said == []
    assert 'data-drawn="5"' in dom


@needs_browser
@pytest.mark.slow
def test_an_incomplete_run_has_a_page_that_works(made_up, tmp_path):
    path = tmp_path / "report.html"
    path.write_text(page(made_up("interrupted", with_geometry=False)), encoding="utf-8")
    dom, said = look_at(path, tmp_path / "profile")
    assert said == []
    assert "Incomplete." in dom


@needs_browser
@pytest.mark.slow
def test_the_console_is_heard_and_the_network_is_barred(tmp_path):
    """The tests above mean something: an error and a request would have been seen."""
    path = tmp_path / "bad.html"
    script = "<script>fetch('http://example.invalid/x').catch(() => 0); nowhere();</script>"
    path.write_text(html_markup.document("bad", [script], []), encoding="utf-8")
    _, said = look_at(path, tmp_path / "profile")
    assert any("nowhere is not defined" in line for line in said)
    assert any("Content Security Policy" in line for line in said)
