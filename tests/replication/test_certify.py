"""Content of a manifest, and messages of `trackdyn verify` on a run that is not the one of the manifest."""

import json
import os
import shutil

import numpy as np
import pytest
from PIL import Image

from tests.conftest import refused, run_command, written
from trackdyn.inputs.files import write_npz
from trackdyn_replication import certify
from trackdyn_replication.certify import DIFFERS, EQUAL, WITHIN, describe, load_manifest, write_manifest

TABLE = "run,rms_g,wall_s,loop_gap_max_m,note\n115rpm,0.924182,6.4,2.8e-14,\n150rpm,1.08251,7.1,3.1e-14,loose\n"


@pytest.fixture
def results(tmp_path):
    """Two figures, tables, a recording, files that hold times, and a further run below it."""
    folder = tmp_path / "results"
    for name, text in {
        "metrics.csv": TABLE, "tables/table3.csv": TABLE, "peers.json": '{"fields": [1]}\n',
        "report.html": "<p>6 s</p></html>\n", "benchmarks/a.csv": "s\n1\n", "kernels/a.npz": "kernels",
        "quick/kernels/a.npz": "kernels", "quick/tables/table3.csv": "another run", "figures/fig24.svg": "<svg/>",
        "figures/fig24.png": "picture", "runs/115rpm.npz": "recording",
        "tables/.table4.0123abcd-77-77.trackdyn-part.csv": "half",
    }.items():  # fmt: skip
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        written(folder / name, text)
    return folder


def test_what_a_run_has_made_is_in_it_and_nothing_else(results, tmp_path):
    files = describe(results)
    names = "figures/fig24.png figures/fig24.svg metrics.csv peers.json runs/115rpm.npz tables/table3.csv"
    assert " ".join(files) == names
    assert "wall_s" not in files["tables/table3.csv"].text
    path = write_manifest(results, ["trackdyn/rigs/paper.yaml"])
    before = path.read_bytes()
    assert write_manifest(results, ["trackdyn/rigs/paper.yaml"]).read_bytes() == before
    assert load_manifest(path).files == files
    refused(describe, tmp_path, words=["holds no figure, table or recording"])
    refused(describe, tmp_path / "absent", words=["no such folder"])


def test_an_input_that_is_another_file_or_gone_is_no_equal_run(results, tmp_path, monkeypatch):
    """Whatever its date; names are those of the folder of the run, or of one above the results."""
    record = written(tmp_path / "115rpm.csv", "t,ay\n0,1\n")
    monkeypatch.chdir(tmp_path)
    write_manifest(results, [record.name])
    monkeypatch.chdir("/")
    assert run_command("verify", results)[0] == 0
    os.utime(written(record, "t,ay\n0,2\n"), (1.5e9, 1.5e9))
    code, output, _ = run_command("verify", results)
    assert code == 1 and "differs  115rpm.csv  is another input than the results were made from" in output
    assert "`snakemake -j2 --forceall` if that has nothing to do, as after `--touch`" in output
    record.unlink()
    code, output, _ = run_command("verify", results)
    assert code == 1 and "missing  115rpm.csv" in output


def test_a_recording_of_another_configuration_is_no_equal_run(results):
    """As `--touch` or `rerun-triggers: mtime` leave it: a configuration was changed, and no run was made again."""
    scene, rig = {"duration": 90.0, "step": 1e-4, "pitches": []}, {"chain": {"pitches": 35}}
    first, second = stated = {f"runs/{k}rpm.npz": scene | {"rig": certify.rig_hash(rig)} for k in (115, 150)}
    for name in stated:
        write_npz(results / name, {"scene": scene | {"ramp": 1.0}, "rig": rig}, {"time": np.zeros(1)})
    write_manifest(results, [], stated)
    assert run_command("verify", results).code == 0
    command = f"snakemake -j2 -R {results}/{first} {results}/{second}"
    remedy = f"another configuration ({{}}), and so are {second}; run `{command}`"
    other = certify.rig_hash({"chain": {}})
    for change, words in (({"duration": 80.0}, "duration = 90.0, now 80.0"), ({"rig": other}, "rig")):
        changed = {name: fields | change for name, fields in stated.items()}
        refused(write_manifest, results, [], changed, words=[remedy.format(words)])
    many = {f"runs/{k}rpm.npz": changed[first] for k in range(30)}
    for name in many:
        shutil.copy(results / first, results / name)
    refused(write_manifest, results, [], many, words=["and so are ", ", ...; run `snakemake -j2 --forceall`"])
    for name in many.keys() - stated.keys():
        (results / name).unlink()
    write_npz(results / "runs/115rpm.npz", {"scene": scene | {"duration": 80.0}, "rig": rig}, {"time": np.zeros(1)})
    done = run_command("verify", results)
    assert done.code == 1 and f"differs  {first}  is of another configuration (duration = 80.0, now 90" in done.out


# text of metrics.csv, its replacement, status, words of the message
@pytest.mark.parametrize(("old", "new", "status", "message"), [
    ("6.4", "8.8", EQUAL, ""),  # a time
    ("0.924182", "0.924190", WITHIN, "within the tolerance"),
    ("0.924182", "0.924282", DIFFERS, "rms_g in row 1 is 0.924282, expected 0.924182"),
    ("2.8e-14", "9.8e-13", WITHIN, "within the tolerance"),
    ("2.8e-14", "2.8e-08", DIFFERS, "loop_gap_max_m in row 1 is 2.8e-08"),
    ("loose", "tight", DIFFERS, "note in row 2 is tight, expected loose"),
    ("0.924182", "nan", DIFFERS, "rms_g in row 1 is nan"),
    ("run,rms_g", "run,rms", DIFFERS, "columns differ: rms"),
    ("150rpm,1.08251,7.1,3.1e-14,loose\n", "", DIFFERS, "1 rows, expected 2"),
    ("115rpm,0.924182", "116rpm,0.934182", DIFFERS, "run in row 1 is 116rpm, expected 115rpm; 2 values"),
])  # fmt: skip
def test_a_change_is_judged_and_named(results, old, new, status, message):
    expected = describe(results)
    assert TABLE.count(old) == 1
    written(results / "metrics.csv", TABLE.replace(old, new))
    findings = {finding.name: finding for finding in certify.compare_files(results, expected)}
    changed = findings.pop("metrics.csv")
    assert changed.status == status and message in changed.text
    assert {finding.status for finding in findings.values()} == {EQUAL}


def test_the_command_names_what_differs_is_missing_or_more_and_ends_with_1(results):
    manifest = write_manifest(results)
    assert run_command("verify", results) == (0, "6 equal\n", "")
    (results / "peers.json").write_text('{"fields": [2]}\n')
    assert run_command("verify", results).code == 0
    code, out, err = run_command("verify", results, "--exact", "--against", manifest)
    assert code == 1 and "bytes  peers.json  bytes differ" in out
    assert err == f"trackdyn: {results}: 1 of 6 files are not those of {manifest}\n"
    (results / "metrics.csv").rename(results / "other.csv")
    code, out, err = run_command("verify", results)
    assert code == 1 and " missing  metrics.csv\n" in out and "   extra  other.csv\n" in out
    assert "1 missing" in out and "1 of 7 files" in err


@pytest.mark.parametrize(("text", "message"), [
    ("", "not a trackdyn manifest, or damaged"),
    ("[]", "must hold sections"),
    ('{"format": 3}', "made_with is missing; `snakemake -j2` makes a manifest"),
    ('{"format": 99}', f"has manifest format 99, this version reads {certify.FORMAT}; write it again"),
])  # fmt: skip
def test_a_file_that_is_no_manifest_is_refused(tmp_path, text, message):
    refused(load_manifest, written(tmp_path / "manifest.json", text), words=[message])


@pytest.mark.parametrize(("key", "value"), [("sha256", "x"), ("bytes", "many"), ("more", 1)])
def test_a_damaged_entry_is_refused(results, key, value):
    manifest = write_manifest(results)
    data = json.loads(manifest.read_text(encoding="utf-8"))
    data["files"]["metrics.csv"][key] = value
    refused(load_manifest, written(manifest, json.dumps(data)), words=[f"manifest.json: files.'metrics.csv'.{key}"])


@pytest.mark.parametrize(("name", "write"), [
    ("figures/fig24.png", Image.effect_noise((90, 60), 9.0).save),
    ("figures/fig24.svg", lambda path: path.write_text("<svg>" + "<g/>" * 99 + "</svg>")),
    ("runs/115rpm.npz", lambda path: np.savez(path, a=np.arange(999.0))),
    ("tables/long.csv", lambda path: path.write_text("t,a\n" + "".join(f"{k},{k % 7}\n" for k in range(30_000)))),
    ("metrics.csv", lambda path: path.write_text("a,b\n1,2\n3,4\n")),
])  # fmt: skip
def test_a_damaged_file_fails(results, tmp_path, name, write):
    """Against the manifest of the results, and against another folder where a table is too long for one."""
    write(path := results / name)
    whole, reference = path.read_bytes(), write_manifest(results)
    if name == "tables/long.csv":
        reference = shutil.copytree(results, tmp_path / "other")
    assert run_command("verify", results, "--against", reference).code == 0
    cut = [whole[:end] for end in (-1, len(whole) * 97 // 100, len(whole) // 2)]
    flipped = [whole[:-9] + b"\xff" + whole[-8:]] if path.suffix == ".csv" else []
    for damaged in (b"", np.random.default_rng(1).bytes(len(whole)), *cut, *flipped):
        path.write_bytes(damaged)
        code, out, err = run_command("verify", results, "--against", reference)
        assert code == 1 and f"differs  {name}" in out and "Traceback" not in err, len(damaged)
    if name == "figures/fig24.png":  # whole pictures, of nothing and of noise
        for other in (Image.new("L", (90, 60)), Image.effect_noise((90, 60), 99.0)):
            other.save(path)
            assert run_command("verify", results, "--against", reference).code == 1
