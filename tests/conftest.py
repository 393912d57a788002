"""The rigs and loops that run on one of them, made once for all tests."""

import os

# Before numpy is loaded, and handed on to child processes: the threads of BLAS share out matrices of a few dozen rows,
# and spin in between. That cost more than a hundred times the CPU time of one thread.
os.environ.setdefault("OMP_NUM_THREADS", "1")

import contextlib
import io
import multiprocessing.process
import shutil
import subprocess
import sys
from collections import namedtuple
from functools import cache
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from trackdyn import InputError, Loop, Recording, Scene, jit, load_rig
from trackdyn.commands import cli
from trackdyn.measure.contacts import contacts
from trackdyn.model.arrays import SIDES, make_record, make_state
from trackdyn.simulation.recording import provenance
from trackdyn.simulation.settling import Layout

ROOT = Path(__file__).parents[1]
RIG = Path(__file__).with_name("viscous.yaml")  # which does not move with the default one
# long enough for a steady drive of the sprocket, short enough for a test
SHORT = {"duration": 0.5, "lead_in": 0.2, "ramp": 0.4}
# compiling costs minutes: tests of spatial runs, of sprung tensioners and of other integrators share these laws
LAWS = {"drag": "rolling", "bushing_law": "hysteretic"}
BELT = {"chain": "belt", "ring_radius": None, "contact_log": False}


def pytest_addoption(parser):
    parser.addoption("--no-kernels", action="store_true", help="skip tests that call a kernel or start a process")


@pytest.fixture(scope="session", autouse=True)
def _no_kernels(pytestconfig):
    """With ``--no-kernels`` a test ends where it first calls a kernel, compiled before or not, or starts a process."""
    with pytest.MonkeyPatch.context() as patch:
        if pytestconfig.getoption("--no-kernels"):
            patch.setattr(jit._Kernel, "dispatcher", property(lambda _: pytest.skip("calls a kernel")))
            patch.setattr(subprocess.Popen, "_execute_child", lambda *_: pytest.skip("starts a process"))
            patch.setattr(multiprocessing.process.BaseProcess, "start", lambda *_: pytest.skip("starts a process"))
        yield


def pytest_collection_modifyitems(config, items):
    # one worker compiles the default kernel for the pages while another reads files, so that none compiles it twice;
    # then come tests that start processes and wait for them, and small files last, so that workers end together
    rank = {"test_pages": 0, "sensor": 1, "docs": 2, "workflow": 2, "rig": 4}
    items.sort(key=lambda item: rank.get(item.path.stem, rank.get(item.path.parent.name, 3)))
    for item in items:
        if "browser" in item.fixturenames:
            item.add_marker("browser")
            if config.getoption("--no-kernels"):  # playwright does not survive that its process is refused
                item.add_marker(pytest.mark.skip(reason="starts a process"))


@pytest.fixture(scope="session")
def rig():
    return load_rig(RIG)


@pytest.fixture(scope="session")
def make_scene(rig):
    """Function that makes a short scene: ``make_scene(115, ring_radius=None)``."""

    return lambda motor_rpm=115.0, rig=rig, **fields: Scene(rig, motor_rpm, **{**SHORT, **fields})


Ended = namedtuple("Ended", "code out err")


def run_command(*words):
    """Exit code, output and errors of a command, run within this process."""
    out, err, code = io.StringIO(), io.StringIO(), 0
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(sys, "argv", ["trackdyn", *map(str, words)])
        try:
            with contextlib.redirect_stdout(out), contextlib.redirect_stderr(err):
                cli.main()
        except SystemExit as end:
            code = end.code or 0
    return Ended(code, out.getvalue(), err.getvalue())


def run_python(*words, cwd=ROOT, **environment):
    """Exit code, output and errors of another Python: ``run_python("-m", "snakemake", PYTHONPATH=ROOT)``."""
    environment = os.environ | {name: str(value) for name, value in environment.items()}
    done = subprocess.run([sys.executable, *map(str, words)], cwd=cwd, env=environment, capture_output=True, text=True)
    return Ended(done.returncode, done.stdout, done.stderr)


def refused(call, *arguments, words=(), start="", match=None, error=InputError, **keywords):
    """The refusal of a call: one sentence with this start, these words and this pattern."""
    with pytest.raises(error, match=match) as caught:
        call(*arguments, **keywords)
    sentence = str(caught.value)
    assert "\n" not in sentence and len(sentence) < 700 and sentence.startswith(str(start)), sentence
    assert not [word for word in words if word not in sentence], sentence
    return sentence


def written(path, content):
    path.write_bytes(content if isinstance(content, bytes) else content.encode("utf-8"))
    return path


def python(code, *words, check=True, cwd=None, **environment):
    """Run code in another Python, which finds the packages in any folder; by default it must not fail."""
    ended = run_python("-c", code, *words, cwd=cwd, PYTHONPATH=ROOT, **environment)
    assert not (check and ended.code), ended.err
    return ended


def recorded(scene, **options):
    """Record of a scene by its loop: no piece of it is run again with a finer step."""
    loop = Loop(scene)
    loop.lead_in()
    return loop.record(scene.duration, **options)


def assert_same_arrays(recording, expected):
    for name in Recording.ARRAYS:
        np.testing.assert_array_equal(getattr(recording, name), getattr(expected, name), err_msg=name)


def contact_table(recording):
    """`contacts` as a table, pitches from 1 and sides by name."""
    rows = pd.DataFrame(contacts(recording))
    side, share = np.array(SIDES, object)[rows["side"]], 100 * rows["touching_s"] / recording.periods.turn
    return rows.assign(side=side, share_pct=share, pitch=rows["pitch"] + 1, connector=rows["connector"] + 1)


def made_recording(scene, time, force, begin=0.0, layout=Layout(), **arrays):
    """A recording with these arrays, of contacts above all; others are zero or empty."""
    state, pitches = make_state(scene.bodies, scene.rig.chain.pitches, 1 + len(scene.rig.wheels)), force.shape[1]
    record = make_record(len(time), state, 1, range(1, pitches + 1))
    blank = record.samples._asdict() | {"frame": record.frame, "frame_time": np.zeros(0)}
    blank |= {"contact_log": record.contact_log.rows, "pitches": record.pitches + 1, "force": force} | arrays
    return Recording(time=time, begin=begin, meta=provenance(scene, layout), **blank)


@pytest.fixture(scope="session")
def driven_loop(make_scene):
    """Function that gives an own copy of the loop a second after the start; ``ring_radius=None`` is no ring."""

    @cache
    def made(ring_radius, motor_rpm):
        loop = Loop(make_scene(motor_rpm, ring_radius=ring_radius))
        loop.advance(1.0)
        return loop

    return lambda ring_radius=0.308, motor_rpm=115.0: made(ring_radius, motor_rpm).copy()


@pytest.fixture
def pyplot():
    """``matplotlib.pyplot`` without a window, for a test that leaves no figure open."""
    pyplot = pytest.importorskip("matplotlib.pyplot")
    pyplot.switch_backend("Agg")
    yield pyplot
    pyplot.close("all")


BROWSERS = ("chromium", "chromium-browser", "google-chrome", "google-chrome-stable", "chrome", "microsoft-edge")
BROWSER_ARGUMENTS = [
    "--headless", "--no-sandbox", "--disable-gpu", "--disable-background-networking", "--disable-component-update",
    "--disable-sync", "--no-first-run",
]  # fmt: skip


@pytest.fixture(scope="session")
def browser():
    api = pytest.importorskip("playwright.sync_api", reason="playwright is not installed: no test in a browser")
    path = next((executable for name in BROWSERS if (executable := shutil.which(name))), None)
    if path is None:
        pytest.skip(f"no browser (looked for {', '.join(BROWSERS)}): the page is not tested in one")
    with api.sync_playwright() as playwright:
        started = playwright.chromium.launch(executable_path=path, args=BROWSER_ARGUMENTS)
        yield started
        started.close()


@pytest.fixture
def broken_rules():
    """Function that lists the rules of accessibility that a page breaks, all of its details open."""
    axe = pytest.importorskip("axe_playwright_python.sync_playwright", reason="axe is not installed")

    def broken(page):
        page.eval_on_selector_all("details", "all => all.forEach(e => { e.open = true; })")
        violations = axe.Axe().run(page).response["violations"]
        return [(rule["id"], node["html"][:100]) for rule in violations for node in rule["nodes"]]

    return broken


@pytest.fixture
def open_file(browser):
    """Function that opens a page from disk; afterwards nothing may have failed or gone to the network."""
    opened, problems = [], []

    def open_it(path, width=1200, height=900, address="", **options):
        context = browser.new_context(viewport={"width": width, "height": height}, **options)
        context.set_default_timeout(300_000)  # ms, on a busy machine
        opened.append(context)
        page = context.new_page()
        page.on("console", lambda m: problems.append(m.text) if m.type in ("error", "warning") else None)
        page.on("pageerror", lambda error: problems.append(str(error)))
        page.on("request", lambda r: None if r.url.startswith(("file:", "data:", "blob:")) else problems.append(r.url))
        page.goto(path.as_uri() + address)
        page.wait_for_function("document.documentElement.dataset.drawn")
        return page

    yield open_it
    for context in opened:
        context.close()
    assert problems == []
