"""The pages of wheel, check and spread as HTML, in a browser: whole, silent, for every screen and reader."""

import shutil

import pytest
from axe_playwright_python.sync_playwright import Axe
from playwright.sync_api import sync_playwright
from test_wheel_page import page_of

from virtual_soil.report.html_page import write_html

CHROMIUM = next(filter(None, map(shutil.which, ("chromium", "chromium-browser", "google-chrome"))), None)
pytestmark = pytest.mark.skipif(CHROMIUM is None, reason="needs Chromium: apt-get install chromium")
PHONE = {"width": 390, "height": 844}


@pytest.fixture(scope="module")
def page(tmp_path_factory):
    """The page of made-up runs, open; `requests` and `messages` must stay empty."""
    folder = tmp_path_factory.mktemp("wheel")
    page_of(folder)
    write_html(folder / "wheel.md", folder / "wheel.html")
    shutil.rmtree(folder / "wheel")  # the file stands alone
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=CHROMIUM, args=["--no-sandbox"])
        opened, address = browser.new_page(), (folder / "wheel.html").as_uri()
        opened.requests_made, opened.messages = [], []
        opened.on("request", lambda request: opened.requests_made.append(request.url))
        opened.on("console", lambda message: opened.messages.append(message.text))
        opened.goto(address, timeout=120_000)
        yield opened
        browser.close()


def test_every_figure_is_seen_and_has_words(page):
    images = page.locator("img").all()
    assert len(images) == 4
    for image in images:
        assert image.evaluate("image => image.naturalWidth") > 300
        assert len(image.get_attribute("alt")) > 20


def test_contents_lead_to_their_sections(page):
    links = [link.get_attribute("href") for link in page.locator("nav a").all()]
    assert links == ["#wheel", "#plate", "#cone", "#soil-card"]
    assert all(page.locator(link).count() == 1 for link in links)
    assert page.title() == "virtual-soil: Wheel, plates and cone on the calibrated soil"


@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_axe_finds_nothing(page, scheme):
    page.emulate_media(color_scheme=scheme)
    results = Axe().run(page)
    assert results.violations_count == 0, results.generate_report()


def test_on_a_phone_tables_scroll_and_the_page_does_not(page):
    page.set_viewport_size(PHONE)
    assert page.evaluate("document.documentElement.scrollWidth") <= PHONE["width"]
    assert page.locator(".scroll").first.evaluate("frame => frame.scrollWidth > frame.clientWidth")


# last: everything that was done to the page before
def test_nothing_was_fetched_and_the_console_stayed_silent(page):
    assert len([url for url in page.requests_made if not url.startswith("data:")]) == 1
    assert page.messages == []


def test_what_stands_in_a_page_is_text(tmp_path):
    (tmp_path / "page.md").write_text(
        "# A & B\n\n<script>alert(1)</script>\n\n## <b>\n\n| a |\n| --- |\n| <i> |\n", encoding="utf-8"
    )
    write_html(tmp_path / "page.md", tmp_path / "page.html")
    text = (tmp_path / "page.html").read_text(encoding="utf-8")
    assert "<title>virtual-soil: A &amp; B</title>" in text
    assert "<script>" not in text
    assert "<td>&lt;i&gt;</td>" in text


def test_a_picture_that_is_missing_is_named(tmp_path):
    (tmp_path / "page.md").write_text("![rim](figures/rim.png)\n", encoding="utf-8")
    with pytest.raises(FileNotFoundError, match=r"rim\.png"):
        write_html(tmp_path / "page.md", tmp_path / "page.html")
