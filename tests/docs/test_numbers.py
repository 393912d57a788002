"""Numbers that are typed in documents (results are filled in) are those of the program and the configuration."""

import re
from collections import Counter

import pandas as pd
import pytest
import yaml

from laboratory.plausible.distances import SHARES, TIMES
from laboratory.plausible.settings import load_plausible
from tests.conftest import ROOT
from trackdyn import load_rig
from trackdyn.fieldtest.compare import SPEED_TOLERANCE
from trackdyn.fieldtest.samples import BRIDGED, BRIDGED_SHARE, HIGHEST_RATE_HZ
from trackdyn.fieldtest.sensor_mapping import RATES
from trackdyn.measure import planner
from trackdyn.measure.contacts import TOUCHING
from trackdyn.measure.ring_rule import DECIDED, MARGIN_PCT, NARROW, ROUNDS, SPAN, RingRule, with_tooth_forces
from trackdyn.measure.spectra import HIGH_HZ
from trackdyn.rig.rig import parameter_table, shipped_rigs
from trackdyn.scene.choices import preset
from trackdyn.scene.rings import TIGHTER, study_radii
from trackdyn.scene.scene import StopRule
from trackdyn.simulation import step_check
from trackdyn.simulation.energy_balance import LARGEST_RESIDUAL
from trackdyn.simulation.replay import LONGEST_STRETCH
from trackdyn_replication.certify import NOTHING, RELATIVE
from trackdyn_replication.paper.published import RADIUS_CHOSEN
from trackdyn_replication.paper.tracks import RUBBER

DOCUMENTS = [*sorted((ROOT / "docs").glob("*.md")), ROOT / "README.md", ROOT / "CONTRIBUTING.md"]
TEXTS = {path.name: " ".join(path.read_text(encoding="utf-8").split()) for path in DOCUMENTS}
WORDS = {2: "two", 3: "three", 4: "four", 5: "five", 11: "eleven", 20: "twenty"}
RIG, TRACKS = load_rig("paper"), load_plausible(ROOT / "config" / "plausible.yaml")
CONFIG = yaml.safe_load((ROOT / "config" / "config.yaml").read_text(encoding="utf-8"))
SLURM = yaml.safe_load((ROOT / "profiles" / "slurm" / "config.yaml").read_text(encoding="utf-8"))
SHEAR = parameter_table("paper").set_index("name").loc["ring_contact.shear_stiffness"]
# parts of sentences that a page must have
REPEATED = {
    "choose-a-ring.md": [
        f"at every speed and load at most {'half' if RingRule().tooth_force == 0.5 else RingRule().tooth_force} of",
        f"rings up to 1/{1 / SPAN:.0f} above the chosen one (a millimetre)",
        f"kept by less than {WORDS[DECIDED]} of its errors",
        f"free (below {TOUCHING:g} % of a turn)",
        f"100 % over the teeth, and {WORDS[MARGIN_PCT]} points",
        f"The default is {WORDS[len(study_radii(RIG))]} radii",
        f"to about {WORDS[TIGHTER]} times its pre-tension",
        f"to {1e3 * NARROW:g} mm and in at most {WORDS[ROUNDS]} steps",
        f"soft, {SHEAR['low'] / 1e3:g} kN/m a link, and hard, {SHEAR['high'] / 1e3:g} kN/m",
        f"The paper chooses {RADIUS_CHOSEN:g} m",
    ],
    "compare-your-sensor.md": [
        f"more than {SPEED_TOLERANCE * 100:g} % faster or slower",
        f"`gravity` of the rig, {RIG.gravity:g} m/s2",
        f"--rate 1000` ({RATES[0]:.0f} to {RATES[1]:,.0f} Hz)",
        f"interpolates at most {BRIDGED} in a row and {100 * BRIDGED_SHARE:g} % of the rows",
        f"more than {HIGHEST_RATE_HZ:,.0f} Hz is filtered",
        f"the content from {HIGH_HZ:g} Hz on",
    ],
    "answer.md": [
        f"draw {TRACKS.default_draw} of the sample",
        f"within {TRACKS.engaged.time_s:g} s of {TIMES[False]['right gone']:g} and {TIMES[False]['out']:g} s",
        f"within {TRACKS.engaged.share_pct:g} points of {SHARES[True]['ring']:g} % of a turn",
    ],
    "glossary.md": [
        f"RMS of the acceleration from {HIGH_HZ:g} Hz on",
        f"{RUBBER[0]:g} to {RUBBER[1]:g} is assumed for rubber",
    ],
    "model.md": [
        f"a loop of $n = {2 * RIG.chain.pitches}$ rigid bodies",
        f"the gear ratio of {RIG.sprocket.transmission_ratio:g}",
        f"The sprocket has {RIG.sprocket.teeth} grooves",
        f"{RIG.sprocket.teeth} pitches fill a turn of the sprocket. The paper prints {RADIUS_CHOSEN:g} m",
        f"The product of {2 * RIG.chain.pitches - 1} such matrices",
    ],
    "your-own-rig.md": [
        f"the loop of {load_rig('bench').chain.pitches} pitches",
        f"the default: {RIG.chain.pitches} pitches",
        f"{load_rig('m113').chain.pitches} double-pin shoes",
        f"a pitch of {1e3 * load_rig('robot').pitch:.0f} mm",
        f'worn by 1 %: `chain: {{source: "worn by 1 %", pitch: {1.01 * load_rig("bench").pitch:.4f} m}}`',
    ],
    "running.md": [f"a share of {RELATIVE:.0e}, or {NOTHING:.0e} of the largest".replace("e-0", "e-")],
    "show.md": [f"`--seconds`: up to {LONGEST_STRETCH:g} s"],
    "speed-and-accuracy.md": [
        f"linearly implicit at {1e3 * preset('fast')['step']:g} ms",
        f"semi-implicit Euler at {1e3 * preset('standard')['step']:g} ms, without a ring at "
        f"{1e3 * preset('standard', ring=False)['step']:g} ms",
        f"semi-implicit Euler at {1e3 * preset('paper')['step']:g} ms, for the ring study; `reference`: at "
        f"{1e3 * preset('reference')['step']:g} ms",
        f"is at most {100 * planner.SETTING_SHARE:g} % of the tolerance",
        f"a linearly implicit one of {1e3 * planner.IMPLICIT_STEP:g} ms",
        f"{WORDS[step_check.PIECE]} seconds of every {WORDS[step_check.PIECE_PERIOD]} are repeated with a quarter",
        f"RMS up to {50 * step_check.RMS:g} % and mean peak up to {50 * step_check.PEAKS:g} %",
        f"more than {100 * step_check.LARGEST_SHARE:g} % of the motion alternates",
        f"RMS above {100 * step_check.RMS:g} % with an explicit step, or mean peak above {100 * step_check.PEAKS:g} %",
        f"fewer than {WORDS[step_check.LEAST_PITCHES]} pitches reached the sprocket",
        f"to {100 * LARGEST_RESIDUAL:g} % of the energy exchanged",
        f"half widths of {StopRule().share_pct:g} points of a turn for contact durations and "
        f"{100 * StopRule().force:g} % for forces",
        f"change by at most {100 * step_check.RECOMMENDED:g} %",
    ],
    "cluster.md": [
        f"requests {int(SLURM['default-resources']['mem_mb'].split()[0]) / 1000:g} GB and "
        f"{WORDS[int(SLURM['default-resources']['runtime'].split()[0]) / 60]} hours per job",
    ],
    "deviations.md": [
        f"{', '.join(map(str, CONFIG['fidelity']['speeds_rpm'])).replace(', ', ' and ')} rpm, without a ring and with "
        f"that of {CONFIG['ring_study']['radii_m'][5]:g} m",
        f"Sprocket at 115/{RIG.sprocket.transmission_ratio:g} = {115 / RIG.sprocket.transmission_ratio:.3f} rev/min",
        f"at {CONFIG['records']['rounded_sprocket_rpm'][115]} rev/min",
    ],
}


@pytest.mark.parametrize(("page", "words"), [(page, words) for page, parts in REPEATED.items() for words in parts])
def test_a_typed_number_is_that_of_its_source(page, words):
    assert words in TEXTS[page]


def test_the_ring_that_the_readme_prints_is_that_of_the_table():
    rows = pd.read_csv(ROOT / "docs" / "measured" / "ring_trials.csv").query("track == 'bench' and grid != 'beyond'")
    assert f"trackdyn ring bench --rpm {','.join(f'{rpm:g}' for rpm in rows['rpm'].unique())} " in TEXTS["README.md"]
    assert f"#> recommended: a ring of radius {RingRule().radius(with_tooth_forces(rows)):.4f} m" in TEXTS["README.md"]


def test_the_radius_of_the_paper_is_that_of_the_default_rig_and_the_configuration():
    configured = [CONFIG[section]["ring_radius_m"] for section in ("records", "meshing")]
    assert {RADIUS_CHOSEN, RIG.sprocket.ring_radius, *configured} == {0.308}
    assert sum(text.count("0.308 m") for text in TEXTS.values()) > 5


TIME = r"((?:\w+ )?(?:minutes?|hours?|s)\b(?: and a half)?|a quarter of an hour|half a minute)"
# these take the same time wherever they are named; others depend on their options
COMMANDS = (
    *("make replicate", "make quick", "make test", "make docs", "trackdyn new", "trackdyn rigs", "trackdyn show"),
    *("trackdyn check my_rig.yaml", "trackdyn ring my_rig.yaml --rpm 115,210"),
)


def times(command):
    """Times that the documents state for a command: behind it in a comment, or in brackets."""
    pattern = rf"{command}\b[^\n#]*(?:# {TIME}|(?:#|\()[^\n;]*[;,] {TIME})"
    return [m[1] or m[2] for path in DOCUMENTS for m in re.finditer(pattern, path.read_text(encoding="utf-8"))]


@pytest.mark.parametrize("command", COMMANDS)
def test_a_command_takes_the_same_time_in_all_documents(command):
    assert len(set(times(command))) <= 1 and times("make replicate") and times("trackdyn show")


def test_rigs_that_a_page_lists_are_those_of_the_program():
    text = (ROOT / "docs" / "your-own-rig.md").read_text(encoding="utf-8")
    section = text[text.index("## The included rigs") : text.index("## How a file is read")]
    assert sorted(re.findall(r"^- `(\w+)`", section, re.M)) == sorted(shipped_rigs())


def test_measures_and_words_of_the_pages_have_one_meaning():
    """Each term is explained in the glossary or in Contributing, not in both."""
    texts = [(ROOT / page).read_text(encoding="utf-8") for page in ("docs/glossary.md", "CONTRIBUTING.md")]
    terms = [re.split(", *", ", ".join(re.findall(r"^- \*\*(.+?)\*\*", text, re.M))) for text in texts]
    assert min(map(len, terms)) > 30
    assert [term for term, count in Counter(terms[0] + terms[1]).items() if count > 1] == []


def test_short_runs_on_the_page_are_those_of_the_full_study():
    """The default run has two of them; its table must not take the place of the full study's."""
    full = yaml.safe_load((ROOT / "config" / "full_studies.yaml").read_text(encoding="utf-8"))["extremes"]["short_runs"]
    assert pd.read_csv(ROOT / "docs" / "measured" / "extremes_short_runs.csv")["scenes"].sum() == full
