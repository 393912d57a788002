"""The workflow parses, plans every rule, refuses a bad configuration in one sentence, and leaves traces."""

import os
import re
import subprocess
import sys
from pathlib import Path

import pytest
import yaml

ROOT = Path(__file__).parents[2]
RULE_FILES = sorted((ROOT / "workflow" / "rules").glob("*.smk"))
RULE = re.compile(r"^(?:rule|checkpoint)\s+(\w+)\s*:(.*?)(?=^\S|\Z)", re.MULTILINE | re.DOTALL)


def rules_of(text):
    """Name and body of every rule; a body ends where the next unindented line begins."""
    return RULE.findall(text)


RULES = {
    name: (path, body)
    for path in [ROOT / "Snakefile", *RULE_FILES]
    for name, body in rules_of(path.read_text(encoding="utf-8"))
}
SCRIPTED = sorted(name for name, (_, body) in RULES.items() if re.search(r"^ +script:", body, re.MULTILINE))
ON_DEMAND = {"fit", "trade", "extremes"}


def snakemake(tmp_path, *arguments, run="-n"):
    """Plan the workflow of the repository as it stands; nothing is run or locked."""
    return subprocess.run(
        [sys.executable, "-m", "snakemake", run, "--nolock", "--nocolor", *arguments],
        cwd=ROOT,
        env=os.environ | {"XDG_CACHE_HOME": str(tmp_path / "cache")},
        capture_output=True,
        text=True,
        timeout=300,
    )


def quick_config(tmp_path, change=lambda data: None):
    """A copy of the quick configuration whose results do not exist yet."""
    data = yaml.safe_load((ROOT / "config" / "quick.yaml").read_text(encoding="utf-8"))
    data["results"] = str(tmp_path / "results")
    change(data)
    path = tmp_path / "copy.yaml"
    path.write_text(yaml.safe_dump(data), encoding="utf-8")
    return path


def test_the_rules_are_found():
    assert {"all", "warm_up", "simulate", "metrics"} <= RULES.keys()
    assert {"warm_up", "simulate", "metrics"} <= set(SCRIPTED)


def test_dry_run_of_the_quick_configuration_plans_every_rule(tmp_path):
    """Planned from nothing: the results folder of the copy is empty."""
    result = snakemake(tmp_path, "--configfile", str(quick_config(tmp_path)))
    output = result.stdout + result.stderr
    assert result.returncode == 0, output
    planned = dict(re.findall(r"^(\w+) +(\d+)$", output, re.MULTILINE))
    assert set(SCRIPTED) - ON_DEMAND <= planned.keys(), output
    # 4 records and again with the coarse tooth, 2 of meshing, 3 radii and no ring at 2 speeds
    assert int(planned["simulate"]) == 2 * 4 + 2 + 2 * 4
    assert int(planned["warm_up"]) == 1
    assert not (tmp_path / "results").exists()


def test_dry_run_of_the_shipped_quick_configuration(tmp_path):
    result = snakemake(tmp_path, "--configfile", "config/quick.yaml")
    assert result.returncode == 0, result.stdout + result.stderr


def test_a_broken_configuration_ends_in_one_sentence(tmp_path):
    def repeat_a_radius(data):
        data["ring_study"]["radii_m"] = [0.303, 0.308, 0.308]

    result = snakemake(tmp_path, "--configfile", str(quick_config(tmp_path, repeat_a_radius)))
    output = result.stdout + result.stderr
    assert result.returncode != 0
    sentence = (
        "copy.yaml: ring_study.radii_m = [0.303, 0.308, 0.308] is not accepted: 0.308 stands twice; "
        "give rising values"
    )
    assert output.count(sentence) == 1, output
    assert "Traceback (most recent call last)" not in output


def test_a_wrong_number_on_the_command_line_is_refused_too(tmp_path):
    result = snakemake(
        tmp_path, "--configfile", str(quick_config(tmp_path)), "--config", 'records={"duration_s": -1}'
    )
    output = result.stdout + result.stderr
    assert result.returncode != 0
    assert re.search(r"copy.yaml: records.duration_s = '?-1'? is not accepted", output), output
    assert "Traceback (most recent call last)" not in output


@pytest.mark.parametrize("name", SCRIPTED)
@pytest.mark.parametrize("directive", ["log", "benchmark", "message"])
def test_every_rule_with_a_script_leaves_traces(name, directive):
    path, body = RULES[name]
    assert re.search(rf"^ +{directive}:", body, re.MULTILINE), f"{path.name}: rule {name} has no {directive}"


@pytest.mark.parametrize("name", SCRIPTED)
def test_every_script_exists(name):
    path, body = RULES[name]
    script = re.search(r'^ +script:\s*"([^"]+)"', body, re.MULTILINE)
    assert script, f"{path.name}: the script of rule {name} is no plain file name"
    assert (path.parent / script[1]).is_file(), f"{path.name}: {script[1]} of rule {name} is missing"


def test_every_rule_file_is_included():
    text = (ROOT / "Snakefile").read_text(encoding="utf-8")
    included = set(re.findall(r'^include: "workflow/rules/([^"]+)"', text, re.MULTILINE))
    assert included == {path.name for path in RULE_FILES}


def pretend_to_have_run(tmp_path):
    """Empty files in place of every result, and the workflow's own records of how they were made."""
    rig = tmp_path / "rig.yaml"
    rig.write_bytes((ROOT / "config" / "rig.yaml").read_bytes())
    config = quick_config(tmp_path, lambda data: data.update(rig=str(rig)))
    summary = snakemake(tmp_path, "--configfile", str(config), "--summary").stdout
    rows = [line.split("\t")[0] for line in summary.splitlines() if "\t" in line]
    files = [Path(name) for name in rows if name != "output_file"]
    assert len(files) > 50
    for file in files:
        file = file if file.is_absolute() else ROOT / file
        file.parent.mkdir(parents=True, exist_ok=True)
        file.touch()
    result = snakemake(tmp_path, "--configfile", str(config), "-j1", run="--touch")
    assert result.returncode == 0, result.stdout + result.stderr
    return config


def planned_jobs(tmp_path, config):
    """Jobs by rule that a dry run plans."""
    result = snakemake(tmp_path, "--configfile", str(config))
    assert result.returncode == 0, result.stdout + result.stderr
    return {name: int(count) for name, count in re.findall(r"^(\w+) +(\d+)$", result.stdout + result.stderr, re.M)}


def test_only_what_depends_on_a_change_is_planned_again(tmp_path):
    """One more radius costs its own runs, an edited figure its drawing, another rig everything."""
    config = pretend_to_have_run(tmp_path)
    assert planned_jobs(tmp_path, config) == {}

    data = yaml.safe_load(config.read_text(encoding="utf-8"))
    data["ring_study"]["radii_m"].append(0.3135)
    more = tmp_path / "more.yaml"
    more.write_text(yaml.safe_dump(data), encoding="utf-8")
    planned = planned_jobs(tmp_path, more)
    assert planned["simulate"] == len(data["ring_study"]["speeds_rpm"])
    assert {"metrics", "ring_figures", "claims"} <= planned.keys()
    assert not {"meshing_figures", "closure", "sensor_figures", "sensitivity", "warm_up"} & planned.keys()

    drawing = ROOT / "trackdyn" / "report" / "figures" / "ring_study.py"
    text, before = drawing.read_bytes(), drawing.stat()
    try:
        drawing.write_bytes(text + b"\n# edited\n")
        planned = planned_jobs(tmp_path, config)
    finally:
        drawing.write_bytes(text)
        os.utime(drawing, ns=(before.st_atime_ns, before.st_mtime_ns))
    assert "ring_figures" in planned
    assert not {"simulate", "metrics", "claims", "sensitivity"} & planned.keys()

    with (tmp_path / "rig.yaml").open("a", encoding="utf-8") as rig:
        rig.write("# another rig\n")
    assert planned_jobs(tmp_path, config)["simulate"] == 2 * 4 + 2 + 2 * 4
