"""The crate of a run conforms to the profile Workflow Run Crate, as the community's validator judges it, without a
network.
"""

import json
import zipfile
from importlib.resources import files

import pytest

from replication.certify.crate import write_crate
from replication.certify.manifest import write_manifest
from trackdyn.errors import InputError

pytestmark = pytest.mark.slow

INPUTS = ("config/config.yaml", "config/rigs/paper.yaml", "data/synthetic/datapackage.json")
# what the profiles recommend and a run cannot say without inventing somebody
OPEN = {
    "process-run-crate-0.5_3.2": "a url of the program",
    "process-run-crate-0.5_5.1": "the same",
    "process-run-crate-0.5_8.6": "who ran it, unless --agent says so",
    "ro-crate-1.1_22.3": "a publisher",
    "ro-crate-1.1_31.2": "a url of the authors",
    "workflow-ro-crate-1.0_8.1": "the description of the workflow after Bioschemas, which asks for the same",
}


@pytest.fixture
def crate(results):
    write_manifest(results, INPUTS)
    return write_crate(results)


def entities(path):
    with zipfile.ZipFile(path) as archive:
        metadata = json.loads(archive.read("ro-crate-metadata.json"))
        assert archive.testzip() is None
        return {entity["@id"]: entity for entity in metadata["@graph"]}, set(archive.namelist())


def validated(path, monkeypatch):
    """What the validator finds in the profile, and below it in all that it rests on."""
    models = pytest.importorskip("rocrate_validator.models")
    from requests import Response
    from rocrate_validator import services
    from rocrate_validator.utils.http import HttpRequester

    # The context of RO-Crate 1.1 is only to be had from the network. That of 1.3, which comes with the package rocrate,
    # stands in for it, with the terms that had other addresses then.
    terms = json.loads((files("rocrate") / "data" / "ro-crate.jsonld").read_text(encoding="utf-8"))["@context"]
    bioschemas = "https://bioschemas.org/"
    terms |= {name: f"{bioschemas}{name}" for name in ("ComputationalWorkflow", "FormalParameter")}
    terms |= {name: f"{bioschemas}ComputationalWorkflow#{name}" for name in ("input", "output")}

    def get(self, url, **_):
        assert url == "https://w3id.org/ro/crate/1.1/context"
        response = Response()
        response.status_code, response.url = 200, url
        response._content = json.dumps({"@context": terms}).encode()
        response.headers["Content-Type"] = "application/ld+json"
        return response

    monkeypatch.setattr(HttpRequester, "get", get, raising=False)
    settings = models.ValidationSettings(
        rocrate_uri=str(path), profile_identifier="workflow-run-crate", offline=True, cache_path=path.parent / "http",
        requirement_severity=models.Severity.RECOMMENDED,
    )  # fmt: skip
    return [
        (issue.severity.name, issue.check.identifier, issue.message)
        for issue in services.validate(settings).get_issues()
    ]


def test_the_crate_conforms_to_its_profile(crate, monkeypatch):
    issues = validated(crate, monkeypatch)
    assert [issue for issue in issues if issue[0] == "REQUIRED"] == []
    assert {identifier for _, identifier, _ in issues} == OPEN.keys()


def test_inputs_that_are_not_those_of_the_manifest_are_not_packed(results, tmp_path):
    """Whatever a manifest names, nothing is packed whose hash it does not know, nor what it calls a file of times."""
    (tmp_path / "rig.yaml").write_text("mine")
    manifest = write_manifest(results, [tmp_path / "rig.yaml"])
    (tmp_path / "rig.yaml").write_text("changed")
    with pytest.raises(InputError, match=r"rig\.yaml: is an input of the run and no longer what it was"):
        write_crate(results)
    (tmp_path / "rig.yaml").write_text("mine")
    data = json.loads(manifest.read_text(encoding="utf-8"))
    manifest.write_text(json.dumps(data | {"hold_times": [*data["hold_times"], "../rig.yaml"]}))
    _, names = entities(write_crate(results))
    assert [name for name in names if "rig.yaml" in name] == ["inputs/rig.yaml"]


def test_results_that_are_not_those_of_the_manifest_are_not_packed(results):
    write_manifest(results, INPUTS)
    (results / "tables" / "table3.md").write_text("changed")
    with pytest.raises(InputError, match=r"1 known by their bytes alone, which differ \(tables/table3\.md\)"):
        write_crate(results)
    assert not (results / "crate.zip").exists()
