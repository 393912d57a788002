"""A file that cannot be read is refused in one sentence, whoever reads it, and nothing in it is run."""

from pathlib import Path

import pytest
from sentences import ROOT, one_sentence
from snakemake.utils import update_config

from replication.pipeline.config import check_layers, read_layer
from trackdyn.inputs.errors import InputError, shown
from trackdyn.inputs.yaml_file import read_yaml
from trackdyn.rig.rig import load_rig
from trackdyn.simulation.loop import Loop
from trackdyn.simulation.recording import load_recording

FILES = [
    (b"", "must hold sections"),
    (b"- 1\n", "must hold sections"),
    (b"a: [1\n", "is not valid YAML at line 2"),
    ("a: \u00b5\n".encode("latin-1"), "cannot be read as UTF-8 text, byte 0xb5 in line 1"),
    ("a: 1\n".encode("utf-16"), "cannot be read as UTF-8"),
    (b"\0\1\2", "is not valid YAML"),
    (b"a: &x [*x]\n", "line 1 holds an alias (*)"),
    (b"a: &x 1\nb: *x\n", "line 2 holds an alias (*)", "write the value out"),
    (b"a: " + b"[" * 5000, "line 1 is nested more than 20 levels deep"),
    (b"a: 1\nb: 2\na: 3\n", "line 3 gives 'a' a second time"),
    (b"a: {b: 1, b: 2}\n", "line 1 gives 'b' a second time"),
    (b"a: !!python/object/apply:os.system ['touch ran']\n", "is not valid YAML at line 1"),
    (b"a: !!python/name:os.system\n", "is not valid YAML"),
    (b"a: " + b"9" * 5000, "is not valid YAML"),
    (b"#" * 1_000_001, "is larger than 1 MB"),
]


@pytest.mark.parametrize("row", FILES, ids=lambda row: shown(row[0]))
def test_a_yaml_file_is_refused(tmp_path, monkeypatch, row):
    content, *words = row
    monkeypatch.chdir(tmp_path)
    (tmp_path / "mine.yaml").write_bytes(content)
    for read in (read_layer, load_rig):
        with pytest.raises(InputError) as caught:
            read(Path("mine.yaml"))
        assert one_sentence(caught, *words).startswith("mine.yaml: ")
    assert [path.name for path in tmp_path.iterdir()] == ["mine.yaml"]


# as YAML 1.2 has it: 1.1 makes 29, 8, 70, 10.5, 10 and truth values of the first ones, and text of 2e11
NUMBERS = [
    ("035", 35), ("-010", -10), ("1:10", "1:10"), ("1_0.5", "1_0.5"), ("0x0A", "0x0A"), ("0o17", "0o17"),
    ("yes", "yes"), ("off", "off"), ("2024-01-01", "2024-01-01"), ("2e11", 2e11), ("1.0e9", 1e9), ("-.5e3", -500.0),
    ("5.", 5.0), ("true", True), ("'7'", "7"), ("~", None),
]  # fmt: skip


@pytest.mark.parametrize(("text", "value"), NUMBERS)
def test_a_number_is_read_as_it_stands(tmp_path, text, value):
    path = tmp_path / "mine.yaml"
    path.write_text(f"a: {text}\nb: [{text}]\n", encoding="utf-8")
    data = read_yaml(path)
    assert data == {"a": value, "b": [value]} and type(data["a"]) is type(value)


def test_a_later_file_is_on_top_of_an_earlier_one_and_the_command_line_on_top_of_both(tmp_path, monkeypatch):
    monkeypatch.chdir(ROOT)
    path = tmp_path / "mine.yaml"
    path.write_text("records: {duration_s: 0100, lead_in_s: 2e1}\n", encoding="utf-8")
    config, _, _ = check_layers(["config/config.yaml", path], {"records": {"ramp_s": 0.75}}, update_config)
    assert (config.records.duration_s, config.records.lead_in_s, config.records.ramp_s) == (100, 20.0, 0.75)


def test_a_template_is_refused_before_it_is_run(tmp_path):
    """Snakemake's own loader would run it."""
    path = tmp_path / "mine.yaml"
    path.write_text("__use_yte__: true\n?if True:\n  results: x\n", encoding="utf-8")
    with pytest.raises(InputError, match=r"mine\.yaml: __use_yte__ is not a known parameter"):
        read_layer(path)


PLACES = [
    ("/dev/zero", "no plain file but a pipe or a device"), ("/dev/stdin", "a"), (".", "is a folder"),
    ("absent", "no such file"), ("a\0b", "must be the name of"), ("x" * 300, "File name too long"),
    (None, "path = None:"), (b"rig.yaml", "path = b'rig.yaml':"),
]  # fmt: skip


@pytest.mark.parametrize("reader", [load_rig, load_recording, Loop.load, read_yaml])
@pytest.mark.parametrize("row", PLACES, ids=lambda row: shown(row[0]))
def test_a_place_that_holds_no_file_is_refused(tmp_path, monkeypatch, reader, row):
    path, *words = row
    monkeypatch.chdir(tmp_path)
    with pytest.raises(InputError) as caught:
        reader(path)
    one_sentence(caught, *words)
