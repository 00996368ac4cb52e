"""The report in a browser: every view draws and obeys its controls, nothing is fetched, and it can be used without a mouse."""

import csv
import io
import shutil
import time
from types import SimpleNamespace

import numpy as np
import pytest
from axe_playwright_python.sync_playwright import Axe
from campaign import snakemake
from PIL import Image
from playwright.sync_api import sync_playwright

from virtual_soil.campaign.sections import Study
from virtual_soil.campaign.settings import defaults
from virtual_soil.report.contents import FIGURES, TABLES, figure_names

CHROMIUM = next(filter(None, map(shutil.which, ("chromium", "chromium-browser", "google-chrome"))), None)
pytestmark = pytest.mark.skipif(CHROMIUM is None, reason="needs Chromium: apt-get install chromium")

# WebGL without a graphics card; root may not use Chromium's sandbox
SWITCHES = ["--no-sandbox", "--use-angle=swiftshader", "--enable-unsafe-swiftshader", "--ignore-gpu-blocklist"]
DESK, PHONE = {"width": 1280, "height": 900}, {"width": 390, "height": 844}
VIEWS = ("lift", "shear", "grains", "surfaces", "iso")
THREE_DIMENSIONAL = ("lift", "grains", "surfaces")
#: Chromium's advice on speed to Plotly, which reads back the colours of what it draws; no fault of the page.
KNOWN_WARNING = "Canvas2D: Multiple readback operations using getImageData"
#: A page was not loaded after 30 s on a machine with much else to do.
LONG_MS = 120_000


@pytest.fixture(scope="module")
def browser():
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=CHROMIUM, args=SWITCHES)
        yield browser
        browser.close()


@pytest.fixture(scope="module")
def address(finished):
    """The smoke study's report."""
    return (finished / "results" / "smoke" / "report.html").as_uri()


def new_context(browser, **settings):
    context = browser.new_context(**settings)
    context.set_default_timeout(LONG_MS)
    return context


def open_page(browser, address, viewport=DESK, **settings):
    """The page with its context; its `requests` and `messages` must stay empty."""
    context = new_context(browser, viewport=viewport, **settings)
    requests, messages = [], []

    def guard(route):
        if route.request.url == address:
            return route.continue_()
        requests.append(route.request.url)
        return route.abort()

    def listen(message):
        if message.type in ("error", "warning") and KNOWN_WARNING not in message.text:
            messages.append(message.text)

    context.route("**/*", guard)
    page = context.new_page()
    page.on("console", listen)
    page.on("pageerror", lambda error: messages.append(str(error)))
    page.goto(address)
    return SimpleNamespace(context=context, page=page, requests=requests, messages=messages)


@pytest.fixture
def opened(browser, address):
    """Opens the report; closed after the test, since what is drawn keeps a processor busy."""
    reports = []

    def open_one(**settings):
        reports.append(open_page(browser, address, **settings))
        return reports[-1]

    yield open_one
    for report in reports:
        report.context.close()


@pytest.fixture(scope="module")
def desk(browser, address):
    """The report on a desk, every view drawn."""
    report = open_page(browser, address)
    yield drawn(report)
    report.context.close()


def drawn(report):
    for view in VIEWS:
        plot(report, view)
    return report


def plot(report, view):
    """The plot of a view, when it has drawn."""
    figure = report.page.locator(f"figure[data-view={view}]")
    figure.scroll_into_view_if_needed()
    report.page.wait_for_selector(f"figure[data-drawn={view}]")
    return figure.locator(".plot")


def picture(locator) -> np.ndarray:
    return np.asarray(Image.open(io.BytesIO(locator.screenshot())).convert("RGB"), int)


def still(locator) -> np.ndarray:
    """The picture when it no longer changes."""
    last = picture(locator)
    for _ in range(40):
        time.sleep(0.25)
        now = picture(locator)
        if now.shape == last.shape and (now == last).all():
            return now
        last = now
    raise AssertionError("the picture does not come to rest")


def differs(locator, before: np.ndarray) -> bool:
    """Whether the picture becomes another within some seconds."""
    for _ in range(40):
        now = picture(locator)
        if now.shape != before.shape or (now != before).any():
            return True
        time.sleep(0.25)
    return False


def coloured(pixels: np.ndarray) -> int:
    """Pixels that are no grey."""
    return int((np.ptp(pixels, axis=2) > 40).sum())


@pytest.mark.parametrize("view", VIEWS)
def test_every_view_draws(desk, view):
    assert coloured(still(plot(desk, view))) > 1000


@pytest.mark.parametrize("view", VIEWS)
def test_every_control_changes_the_picture(desk, view):
    area = plot(desk, view)
    controls = desk.page.locator(f"figure[data-view={view}] .controls")
    tried = 0
    for select in controls.locator("select").all():
        values = [option.get_attribute("value") for option in select.locator("option").all()]
        if len(values) > 1:
            before, now = still(area), select.input_value()
            select.select_option(next(value for value in values if value != now))
            assert differs(area, before), select.locator("..").inner_text()
            tried += 1
    for slider in controls.locator("input[type=range]").all():
        before, said = still(area), controls.locator("output").inner_text()
        slider.focus()
        desk.page.keyboard.press("ArrowLeft" if slider.input_value() == slider.get_attribute("max") else "ArrowRight")
        assert differs(area, before)
        assert controls.locator("output").inner_text() != said
        tried += 1
    for name in ("Zoom in", "Zoom out"):
        for button in controls.get_by_role("button", name=name).all():
            before = still(area)
            button.click()
            assert differs(area, before), name
            tried += 1
    assert tried >= 2


@pytest.mark.parametrize("view", THREE_DIMENSIONAL)
@pytest.mark.parametrize("key", ["ArrowLeft", "ArrowUp", "+"])
def test_three_dimensional_views_obey_the_keyboard(desk, view, key):
    area = plot(desk, view)
    before = still(area)
    area.focus()
    desk.page.keyboard.press(key)
    assert differs(area, before)


def test_the_lift_plays_to_its_end(desk):
    plot(desk, "lift")
    controls = desk.page.locator("figure[data-view=lift] .controls")
    controls.get_by_role("button", name="Play").click()
    assert controls.get_by_role("button", name="Pause").count() == 1
    slider = controls.locator("input[type=range]")
    desk.page.wait_for_function("([input]) => input.value === input.max", arg=[slider.element_handle()])
    controls.get_by_role("button", name="Play").wait_for()


def test_grains_are_drawn_at_their_true_size(desk):
    """Two grains two diameters from centre to centre: the gap is as wide as each of them, whatever font draws them."""
    area = plot(desk, "grains")
    area.evaluate("(plot) => Plotly.relayout(plot, { 'scene.camera.eye': { x: 0, y: -2, z: 0 } })")
    still(area)
    with desk.page.expect_download() as download:
        desk.page.locator("figure[data-view=grains] .controls button[aria-label^=Data]").click()
    radius = float(next(csv.DictReader(io.StringIO(download.value.path().read_text())))["radius_mm"])
    area.evaluate(
        """(plot, radius) => {
            const [x, y, z] = ["x", "y", "z"].map((axis) => {
                const [low, high] = plot._fullLayout.scene[axis + "axis"].range;
                return (low + high) / 2;
            });
            const looks = { "marker.color": "red", "marker.showscale": false, "marker.line.width": 0 };
            return Plotly.restyle(plot, { x: [[x - 2 * radius, x + 2 * radius]], y: [[y, y]], z: [[z, z]], ...looks }, [0]);
        }""",
        radius,
    )
    seen = still(area)
    red = ((seen[..., 0] > 200) & (seen[..., 1:].max(axis=2) < 80)).any(axis=0)
    edges = np.flatnonzero(np.diff(np.concatenate(([False], red, [False])).astype(int)))
    assert len(edges) == 4
    left, gap, right = np.diff(edges)
    assert [left, right] == pytest.approx([gap, gap], rel=0.05, abs=1)


@pytest.mark.parametrize(("button", "columns"), [
    ("figure[data-view=surfaces] .controls button[aria-label^=Data]", "source,static_friction,rolling_friction"),
    ("figure[data-view=lift] .controls button[aria-label^=Data]", "x_mm,y_mm,z_mm,radius_mm"),
    ("button[data-csv=strength_line]", "simulation_id,seed"),
    ("button[data-csv=heap]", "x_m,y_m,z_m"),
])  # fmt: skip
def test_the_data_of_a_figure_is_one_click_away(desk, button, columns):
    with desk.page.expect_download() as download:
        desk.page.locator(button).click()
    rows = list(csv.reader(download.value.path().read_text().splitlines()))
    assert ",".join(rows[0]).startswith(columns)
    assert len(rows) > 3
    assert {len(row) for row in rows} == {len(rows[0])}


def test_plots_follow_the_colour_scheme(opened):
    report = opened(color_scheme="light")
    area = plot(report, "iso")
    light = still(area)
    report.page.emulate_media(color_scheme="dark")
    assert differs(area, light)
    assert np.median(still(area)) < 60 < np.median(light)


@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_axe_finds_nothing(opened, scheme):
    report = drawn(opened(color_scheme=scheme))
    results = Axe().run(report.page)
    assert results.violations_count == 0, results.generate_report()


def test_on_a_phone_nothing_is_wider_than_the_screen(opened):
    report = drawn(opened(viewport=PHONE, is_mobile=True, has_touch=True))
    assert report.page.evaluate("document.documentElement.scrollWidth") <= PHONE["width"]
    assert not report.requests + report.messages


#: How many different bytes an image has when it is drawn small; one of a single colour has one or two.
BYTES_SEEN = """async image => {
    await image.decode();
    const canvas = Object.assign(document.createElement("canvas"), {width: 160, height: 120});
    const context = canvas.getContext("2d");
    context.drawImage(image, 0, 0, canvas.width, canvas.height);
    return new Set(context.getImageData(0, 0, canvas.width, canvas.height).data).size;
}"""


def shows_every_figure(page):
    for figure in page.locator("figure").all():
        name = figure.get_attribute("id")
        shown = figure.locator(".still")
        assert shown.count() == 0 or shown.is_visible(), name
        images = figure.locator("img:visible").all()
        assert images or "3D view" in figure.inner_text(), name
        for image in images:
            assert image.bounding_box()["width"] > 100, name
            assert image.evaluate(BYTES_SEEN) > 10, name


def test_in_print_every_figure_is_a_picture(opened):
    report = opened()
    plot(report, "grains")
    report.page.emulate_media(media="print")
    assert not report.page.locator(".view:visible, nav:visible, button:visible").all()
    shows_every_figure(report.page)
    assert report.page.pdf(format="A4").startswith(b"%PDF")


def test_without_scripts_every_figure_is_a_picture(opened):
    shows_every_figure(opened(java_script_enabled=False).page)


def test_without_webgl_the_flat_views_draw_and_the_others_stay_pictures(browser, address):
    context = new_context(browser, viewport=DESK)
    context.add_init_script("""
        const get = HTMLCanvasElement.prototype.getContext;
        HTMLCanvasElement.prototype.getContext = function (kind, ...more) {
            return kind.startsWith("webgl") ? null : get.call(this, kind, ...more);
        };
    """)
    page = context.new_page()
    page.goto(address)
    report = SimpleNamespace(page=page)
    plot(report, "iso")
    for view in THREE_DIMENSIONAL:
        figure = page.locator(f"figure[data-view={view}]")
        figure.scroll_into_view_if_needed()
        assert figure.locator(".still").is_visible()
    context.close()


def test_the_page_explains_itself_to_a_screen_reader(opened):
    page = opened().page
    assert page.locator("html").get_attribute("lang") == "en"
    levels = [int(tag[1]) for tag in page.locator("h1, h2, h3, h4").evaluate_all("all => all.map((node) => node.tagName)")]
    assert levels[0] == 1
    assert levels.count(1) == 1
    assert max(np.diff(levels)) <= 1
    assert all(image.get_attribute("alt") for image in page.locator("img").all())
    assert page.locator("table").count() == page.locator("table > caption").count()
    page.keyboard.press("Tab")
    assert page.evaluate("document.activeElement.className") == "skip"
    assert page.locator(".skip").bounding_box()["y"] >= 0


# last: everything that was done to the page before
def test_nothing_was_fetched_and_the_console_stayed_silent(desk):
    assert desk.requests == []
    assert desk.messages == []


def test_snakemakes_own_report_shows_figures_and_tables_by_the_steps_of_the_method(browser, finished, tmp_path):
    packed = snakemake(finished, "--report", str(tmp_path / "packed.html"))
    assert packed.returncode == 0, packed.stderr[-3000:]
    context = new_context(browser, viewport=DESK, offline=True)
    page, errors = context.new_page(), []
    page.on("pageerror", lambda error: errors.append(str(error)))
    page.goto((tmp_path / "packed.html").as_uri())
    entries = [*(FIGURES[name] for name in figure_names(defaults(Study) | {"experiments": ["repose", "shear"]})), *TABLES.values()]
    for section in dict.fromkeys(section for section, _ in entries):
        page.get_by_text(section, exact=True).first.click()
        for _, title in (entry for entry in entries if entry[0] == section):
            page.get_by_text(title, exact=True).first.wait_for()
        page.get_by_text("Results", exact=True).first.click()
    context.close()
    assert not errors
