"""The page: complete, self-contained, refusing mixed results, and working in a real browser."""

import json
import re
import shutil
from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from matplotlib.figure import Figure
from plotly.offline import get_plotlyjs

from trackdyn.errors import InputError
from trackdyn.jit import source_hash
from trackdyn.paper.claims import VERDICTS
from trackdyn.parameters.layout import assemble
from trackdyn.parameters.rig import load_rig
from trackdyn.recording import Recording, provenance
from trackdyn.report.figures.animation import still_loop, still_sprocket, write_animation
from trackdyn.report.page.builder import PageInputs, build_page, write_page
from trackdyn.scene import Scene

ROOT = Path(__file__).parents[2]
RIG_FILE = ROOT / "config" / "rig.yaml"
RIG = load_rig(RIG_FILE)
RATE = RIG.sensor.rate
BROWSERS = ("chromium", "chromium-browser", "google-chrome", "google-chrome-stable", "chrome", "microsoft-edge")
BROWSER_ARGUMENTS = [
    "--headless", "--no-sandbox", "--disable-gpu", "--disable-background-networking", "--disable-component-update",
    "--disable-sync", "--no-first-run",
]  # fmt: skip
FRAMES = 40


def turning(rpm, ring_radius, seconds, pitches=(1,), interval=0.01, sources=None):
    """A made-up recording: the assembled loop on a turning sprocket, one arc in area 2 and one link on the ring."""
    samples = round(seconds * RATE)
    time = np.arange(1, samples + 1) / RATE
    laid = assemble(RIG)
    frames = min(FRAMES, round(seconds / interval))
    frame = np.tile(np.concatenate([laid.pins[0], laid.angle, [laid.sprocket_angle]]), (frames, 1))
    frame_time = np.arange(frames) * interval + 1 / RATE
    rate = -2 * np.pi * rpm / RIG.sprocket.transmission_ratio / 60
    frame[:, -1] += rate * frame_time
    loop_hz = -rate / (2 * np.pi) * RIG.sprocket.teeth / RIG.chain.pitches
    mean = np.column_stack([np.zeros(samples), RIG.gravity * np.cos(2 * np.pi * loop_hz * time), np.zeros(samples)])
    force, area = np.zeros((samples, len(pitches), 3)), np.zeros((samples, len(pitches), 2), np.int8)
    force[:, 0, 0], area[:, 0, 0] = 1000 + 500 * np.sin(9 * time), 2
    force[:, -1, 2] = 0.0 if ring_radius is None else 2000.0
    return Recording(
        time=time, raw=mean, mean=mean, gap=np.zeros(samples),
        **dict.fromkeys(("cut", "change", "place"), np.zeros((samples, 2))),
        wheel_rate=np.full((samples, 3), rate), energy=np.zeros((samples, 10)), force=force, area=area,
        groove=(area > 0).astype(np.int8), pitches=np.array(pitches), spells=np.zeros((0, 11)), begin=1.0,
        frame=frame, frame_time=frame_time,
        meta=provenance(Scene(RIG, rpm, ring_radius, frame_interval=interval), {"tensioner_shift_m": laid.shift})
        | {"sources": sources or source_hash(), "versions": {"numpy": np.__version__}},
    )  # fmt: skip


def write_sensor(path, seconds=20.0):
    time = np.arange(round(seconds * RATE)) / RATE
    table = pd.DataFrame({"t_s": time, "ax_g": 0.0, "ay_g": np.cos(2 * np.pi * 0.24 * time), "az_g": 0.0})
    table.to_csv(path, index=False)


def metrics():
    rows = []
    for i, rpm in enumerate((115.0, 210.0)):
        for j, radius in enumerate((np.nan, 0.303, 0.308)):
            name = "none" if np.isnan(radius) else f"{radius:.4g}"
            row = {"run": f"ring/{rpm:g}rpm_{name}", "rpm": rpm, "ring_radius_m": radius}
            for k, side in enumerate(("left", "right", "ring")):
                row |= {f"{side}_share_pct": 10.0 * k + j + 0.5 * i, f"{side}_rms_n": 100.0 * (k + 1) + j}
                row |= {f"{side}_sd_n": 90.0 * (k + 1) + j, f"{side}_phase_start": 0.1 * k}
            rows.append(row)
    return pd.DataFrame(rows)


@pytest.fixture(scope="module")
def inputs(tmp_path_factory):
    """A small results folder with something for most sections of the page."""
    results = tmp_path_factory.mktemp("results")
    turning(210.0, 0.308, 20.0).save(results / "runs" / "210rpm.npz")
    every = tuple(range(1, RIG.chain.pitches + 1))
    for radius in (None, 0.308):
        name = "none" if radius is None else "0.308"
        turning(210.0, radius, 0.4, every).save(results / "runs" / "animation" / f"210rpm_{name}.npz")
    write_sensor(results / "sensor.csv")
    card = [
        {"rig": "shipped", "id": f"C{i:02d}", "part": "", "place": "Fig. 1", "claim": f"Statement {i} </script>",
         "printed": 1.5, "measured": "1.4, 1.6", "unit": "m", "tolerance": 0.2, "verdict": verdict,
         "origin": "predicted" if i < 4 else "", "speeds": "115, 150", "fails_if": "something else came",
         "reason": "Because of a test."}
        for i, verdict in enumerate(VERDICTS, 1)
    ]  # fmt: skip
    pd.DataFrame(card).to_csv(results / "claims.csv", index=False)
    metrics().to_csv(results / "metrics.csv", index=False)
    (results / "tables").mkdir()
    pd.DataFrame({"area": [1, 2], "r_mm": [30.0, 40.0]}).to_csv(results / "tables" / "table1.csv", index=False)
    kinds = [
        {"name": f"x.{kind}", "value": 1, "unit": "m", "kind": kind, "source": "here"} for kind in ("printed", "fitted")
    ]
    pd.DataFrame(kinds).to_csv(results / "tables" / "parameters.csv", index=False)
    trade = {"scene": "ring", "fidelity": "planar", "integrator": "euler", "measure": "rms", "cpu_s_per_s": 0.1}
    steps = [
        trade | {"step_s": s, "wall_s_per_s": 1e-5 / s, "error": 100 * s, "failed": s > 5e-4}
        for s in (1e-4, 2e-4, 1e-3)
    ]
    pd.DataFrame(steps).to_csv(results / "trade.csv", index=False)
    (results / "figures").mkdir()
    figure = Figure(figsize=(7, 3))
    figure.subplots().plot([0, 1])
    figure.savefig(results / "figures" / "fig15.png", dpi=150)
    (results / "figures" / "fig18_a.png").write_bytes((results / "figures" / "fig15.png").read_bytes())
    return PageInputs(results=results, rig=RIG_FILE, sensors={"210rpm": results / "sensor.csv"})


@pytest.fixture(scope="module")
def page_file(inputs):
    path = inputs.results / "report.html"
    write_page(inputs, path)
    return path


def test_recordings_of_another_version_are_refused(inputs, tmp_path):
    shutil.copytree(inputs.results, tmp_path / "mixed")
    turning(210.0, 0.308, 0.1, sources="0123456789abcdef").save(tmp_path / "mixed" / "runs" / "ring" / "old.npz")
    with pytest.raises(InputError, match=r"old\.npz: was made by another version"):
        build_page(PageInputs(results=tmp_path / "mixed", rig=RIG_FILE))


def test_an_empty_folder_gives_a_page_that_says_what_is_missing(tmp_path):
    text = build_page(PageInputs(results=tmp_path, rig=RIG_FILE))
    assert text.count("Not here yet:") == 9
    assert "<strong>0 of 28</strong>" in text
    assert "snakemake -j2 trade" in text


def test_the_same_results_give_the_same_page(inputs, page_file):
    assert build_page(inputs) == page_file.read_text(encoding="utf-8")


def test_the_page_carries_everything_and_is_small(page_file):
    text = page_file.read_text(encoding="utf-8")
    assert page_file.stat().st_size < 20e6
    own = text.replace(get_plotlyjs(), "")
    assert not re.search(r"(src|href)=[\"']?(https?:)?//", own)
    embedded = re.search(r'<script type="application/json" id="data">(.*?)</script>', text, re.DOTALL).group(1)
    assert json.loads(embedded)["ring"]["radii"] == [None, 0.303, 0.308]
    assert own.index("<b>Fitted</b>") < own.index("<b>Printed</b>")


def test_captions_speak_of_synthetic_records_only_where_they_are(inputs):
    sentence = "The synthetic sensor was made to show the printed numbers of the experiment."
    assert sentence in build_page(inputs)
    measured = build_page(replace(inputs, synthetic=False))
    assert "fig18_a" in measured and sentence not in measured


def test_animation_and_stills(tmp_path):
    every = tuple(range(1, RIG.chain.pitches + 1))
    recording = turning(210.0, 0.308, 0.2, every, interval=0.04)
    assert write_animation(recording, tmp_path / "loop.gif") == len(recording.frame)
    assert [p.name for p in tmp_path.iterdir()] == ["loop.gif"]
    assert (tmp_path / "loop.gif").read_bytes()[:3] == b"GIF"
    assert still_loop(recording).axes and still_sprocket(recording).axes
    with pytest.raises(InputError, match="forces of 1 pitches"):
        still_loop(turning(210.0, 0.308, 0.2))


@pytest.fixture(scope="module")
def browser():
    api = pytest.importorskip("playwright.sync_api", reason="playwright is not installed: no test in a browser")
    path = next((found for name in BROWSERS if (found := shutil.which(name))), None)
    if path is None:
        pytest.skip(f"no browser found (looked for {', '.join(BROWSERS)}): the page is not tested in one")
    with api.sync_playwright() as playwright:
        started = playwright.chromium.launch(executable_path=path, args=BROWSER_ARGUMENTS)
        yield started
        started.close()


@pytest.fixture
def open_page(browser, page_file):
    """Function that opens the page from disk; afterwards nothing may have failed or gone to the network."""
    opened, problems = [], []

    def open_it(width=1200, height=900, **options):
        context = browser.new_context(viewport={"width": width, "height": height}, **options)
        opened.append(context)
        page = context.new_page()
        page.on("console", lambda m: problems.append(m.text) if m.type in ("error", "warning") else None)
        page.on("pageerror", lambda error: problems.append(str(error)))
        page.on("request", lambda r: None if r.url.startswith(("file:", "data:", "blob:")) else problems.append(r.url))
        page.goto(page_file.as_uri())
        page.wait_for_function("document.querySelectorAll('.plot .main-svg').length > 0")
        return page

    yield open_it
    for context in opened:
        context.close()
    assert problems == []


def test_charts_are_drawn(open_page):
    page = open_page()
    for plot in ("history-plot", "spectrum-plot", "ring-plot", "trade-plot"):
        assert page.evaluate(f"document.getElementById('{plot}').data.length") > 0
    # plotly keeps what it was given: the sensor's curve has as many points as two revolutions have samples
    span = 2 * 35 / 13 * 60 * 5.57 / 210
    assert page.evaluate("document.getElementById('history-plot').data[0].y.length") == pytest.approx(
        span * RATE, abs=2
    )
    page.select_option("#signal-range", "band")
    assert page.evaluate("document.getElementById('spectrum-plot').layout.yaxis.type") == "log"
    assert "at 0.001" in page.inner_text("#trade-failed")


def test_the_radius_slider_changes_the_values(open_page):
    page = open_page()
    assert page.inner_text("#ring-radius") == "0.308 m"  # the paper's, if it is among them
    before = page.inner_text("#ring-table")
    page.fill("#ring-slider", "0")
    assert page.inner_text("#ring-radius") == "no ring"
    after = page.inner_text("#ring-table")
    assert after != before
    assert "210 rpm" in after and "0.500" in after
    assert page.evaluate("document.getElementById('ring-plot').layout.shapes[0].x0") == 0


def test_the_loop_plays_pauses_and_scrubs(open_page):
    page = open_page()
    page.select_option("#pace", "1")
    first = page.evaluate("document.getElementById('scene').toDataURL()")
    page.click("#play")
    page.wait_for_function("document.getElementById('clock').textContent !== '0.00 s'")
    assert page.evaluate("document.getElementById('scene').toDataURL()") != first
    page.click("#play")
    stopped = page.inner_text("#clock")
    page.wait_for_timeout(150)
    assert page.inner_text("#clock") == stopped
    page.fill("#scrub", str(FRAMES // 2))
    assert page.inner_text("#clock") == f"{0.01 * (FRAMES // 2):.2f} s"
    assert re.search(r"left 1 \(largest \d+ N\), right 0, ring 1", page.inner_text("#readout"))
    page.select_option("#radius", "null")
    assert "ring 0" in page.inner_text("#readout")
    for view in ("loop", "follow", "sprocket"):
        before = page.evaluate("document.getElementById('scene').toDataURL()")
        page.select_option("#view", view)
        assert page.evaluate("document.getElementById('scene').toDataURL()") != before


@pytest.mark.parametrize("width", [380, 1200])
def test_nothing_overflows(open_page, width):
    page = open_page(width, 800)
    assert page.evaluate("document.documentElement.scrollWidth") <= width
    # what is wider than the page scrolls within its own box
    wide = "[...document.querySelectorAll('main *')].filter(e => !e.closest('.wide, .plot') && e.getBoundingClientRect().right > innerWidth + 1)"
    assert page.evaluate(f"{wide}.map(e => e.outerHTML.slice(0, 80))") == []


def test_verdicts_are_readable_without_colour(open_page):
    page = open_page(forced_colors="active")
    shown = page.eval_on_selector_all(
        "#card .badge", "all => all.map(e => [e.innerText, getComputedStyle(e).borderStyle])"
    )
    assert [re.sub(r"^\W+", "", text) for text, _ in shown] == list(VERDICTS)
    assert len({style for _, style in shown}) == len({text[0] for text, _ in shown}) == len(VERDICTS)


def test_claims_can_be_filtered(open_page):
    page = open_page()
    page.click(f"#verdicts button[data-verdict='{VERDICTS[2]}']")
    assert page.locator("#card li:visible").count() == 1
    assert page.inner_text("#shown") == "1 part shown."
    page.fill("#find", "no such words")
    assert page.locator("#card li:visible").count() == 0


def test_dark_mode_is_dark(open_page):
    page = open_page(color_scheme="dark")
    red, green, blue = map(
        int, re.findall(r"\d+", page.evaluate("getComputedStyle(document.body).backgroundColor"))[:3]
    )
    assert red + green + blue < 150
