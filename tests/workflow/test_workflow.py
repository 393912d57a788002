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
ON_DEMAND = {"fit"}  # rules that only run when they are asked for by name


def snakemake(tmp_path, *arguments):
    """Plan the workflow of the repository as it stands; nothing is run or locked."""
    return subprocess.run(
        [sys.executable, "-m", "snakemake", "-n", "--nolock", "--nocolor", *arguments],
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
