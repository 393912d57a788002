"""A provenance crate: the results of a run with the workflow, its inputs and what says so, in one zip file.

After the profile Workflow Run Crate 0.5 of RO-Crate 1.1, so that others can read who made what from what.
"""

from trackdyn.sweeps.job import run_job

from datetime import UTC, datetime
from pathlib import Path
from typing import Any

from replication.certify.comparison import compare_manifests, failed, findings_summary
from replication.certify.manifest import NAME, describe, load_manifest
from replication.certify.provenance import file_hash
from trackdyn.errors import InputError
from trackdyn.extras import required
from trackdyn.files import replacing
from trackdyn.parameters.yaml_file import read_yaml

ROOT = Path(__file__).parents[3]
CRATE = "crate.zip"
PROFILES = {
    "https://w3id.org/ro/wfrun/process/0.5": "Process Run Crate",
    "https://w3id.org/ro/wfrun/workflow/0.5": "Workflow Run Crate",
    "https://w3id.org/workflowhub/workflow-ro-crate/1.0": "Workflow RO-Crate",
}
# what runs: the workflow and the program, as they stand beside each other in the repository
PROGRAM = (
    "workflow", "trackdyn", "profiles", "pyproject.toml", "requirements.lock", "LICENSE",
    "CITATION.cff",
)  # fmt: skip
FORMATS = {
    ".py": "text/x-python", ".smk": "text/x-python", ".js": "text/javascript", ".css": "text/css",
    ".toml": "application/toml", ".j2": "text/plain", ".lock": "text/plain", ".cff": "application/yaml",
    "": "text/plain", ".csv": "text/csv", ".md": "text/markdown", ".json": "application/json", ".png": "image/png",
    ".svg": "image/svg+xml", ".gif": "image/gif", ".html": "text/html", ".yaml": "application/yaml",
    ".pdf": "application/pdf", ".typ": "text/plain", ".bib": "text/plain",
    ".npz": "application/zip",
}  # fmt: skip


def write_crate(
    results: Path | str, out: Path | str | None = None, recordings: bool = False, agent: str | None = None
) -> Path:
    """Write the crate of a run as a zip file.

    Results have the hashes of their ``manifest.json``; recordings, most of a run, are packed if asked for; ``agent`` is
    who ran it.

    Raises
    ------
    InputError
        The manifest is missing, results or inputs are no longer those of the manifest, or the package rocrate is not
        installed.
    """
    ROCrate = required("rocrate.rocrate").ROCrate
    results = Path(results)
    manifest = load_manifest(results / NAME)
    for name, digest in manifest["inputs"].items():
        if not (ROOT / name).is_file() or file_hash(ROOT / name) != digest:
            raise InputError(f"{name}: is an input of the run and no longer what it was; run `snakemake -j2` again")
    present = describe(results)
    findings = compare_manifests(present, manifest)
    changed = [finding.name for finding in failed(findings, exact=True)]
    if changed:
        raise InputError(
            f"{results}: {findings_summary(findings)} ({changed[0]}); "
            "`snakemake -j2 --forcerun manifest` after a look at them"
        )
    crate = ROCrate(version="1.1")
    _fill(crate, results, manifest | {"hold_times": present["hold_times"]}, recordings, agent)
    path = results / CRATE if out is None else Path(out)
    with replacing(path) as temporary:
        crate.write_zip(temporary)
    return path


def _fill(crate: Any, results: Path, manifest: dict[str, Any], recordings: bool, agent: str | None) -> None:
    """Entities of a crate: the workflow, the program, inputs, results, and the run that joins them."""
    from rocrate.model import ContextEntity

    def context(identifier: str, kind: str, **properties) -> Any:
        return crate.add(ContextEntity(crate, identifier, properties={"@type": kind, **properties}))

    cited = read_yaml(ROOT / "CITATION.cff")
    made = datetime.fromtimestamp((results / NAME).stat().st_mtime, UTC).isoformat(timespec="seconds")
    root = crate.root_dataset
    root["conformsTo"] = [
        context(identifier, "CreativeWork", name=title, version=identifier.rpartition("/")[2])
        for identifier, title in PROFILES.items()
    ]
    paper, what = cited["references"][0], "Figures, tables and claims of one run, with the workflow and its inputs."
    root["name"], root["description"] = "A run of trackdyn", f"{cited['abstract']} {what}"
    root["datePublished"] = made
    root["license"] = context("https://spdx.org/licenses/MIT", "CreativeWork", name="MIT License")
    root["citation"] = context(f"https://doi.org/{paper['doi']}", "ScholarlyArticle", name=paper["title"])
    root["author"] = author = context("#authors", "Organization", name=cited["authors"][0]["name"])
    crate.metadata.extra_terms["sha256"] = "http://schema.org/sha256"  # younger than the context of RO-Crate 1.1

    made_with = manifest["made_with"]
    about = {"name": cited["title"], "version": made_with["trackdyn"], "author": author}
    about |= {"license": root["license"], "encodingFormat": FORMATS[".smk"]}
    workflow = crate.add_workflow(
        ROOT / "Snakefile", "Snakefile", main=True, lang="snakemake",
        lang_version=made_with["versions"]["snakemake"], properties=about,
    )  # fmt: skip
    for identifier in PROGRAM:
        for path in [ROOT / identifier] if (ROOT / identifier).is_file() else sorted((ROOT / identifier).rglob("*")):
            if path.is_file() and path.suffix in FORMATS:
                _file(crate, path, path.relative_to(ROOT).as_posix(), None, path.name)
    _file(crate, ROOT / "README.md", "README.md", None, "README.md")["about"] = root

    inputs = []
    for name, digest in manifest["inputs"].items():
        dest = f"inputs/{Path(name).name}" if Path(name).is_absolute() else name
        inputs.append(_file(crate, ROOT / name, dest, digest, f"input: {name}"))
        example = {"additionalType": "File", "workExample": inputs[-1]}
        parameter = context(f"#input-{len(inputs)}", "FormalParameter", name=name, **example)
        inputs[-1]["exampleOfWork"] = parameter
        workflow.append_to("input", parameter)

    outcome = []

    def result(name: str, digest: str | None, shows: str) -> None:
        outcome.append(_file(crate, results / name, f"results/{name}", digest, shows))

    result(NAME, None, "hashes of all results, and the numbers of the tables")
    for name, entry in manifest["files"].items():
        if recordings or not name.endswith(".npz"):
            result(name, None if "times" in entry else entry["sha256"], entry.get("shows", name))
    for name in manifest["hold_times"]:
        if recordings or not name.endswith(".cost.json"):
            result(name, None, f"{name}; holds times, which no two runs share")

    what = {"instrument": workflow, "object": inputs, "result": outcome, "endTime": made}
    run = context("#run", "CreateAction", name="The run", **what)
    run["description"] = "snakemake, from the inputs to the results; endTime is when the manifest was written"
    if agent:
        run["agent"] = context("#agent", "Person", name=agent)
    root["mentions"] = run


def _file(crate: Any, path: Path, dest: str, digest: str | None, name: str) -> Any:
    properties = {"name": name, "encodingFormat": FORMATS[path.suffix], "contentSize": str(path.stat().st_size)}
    return crate.add_file(path, dest, properties=properties | ({"sha256": digest} if digest else {}))


def main(job) -> None:
    """Rule `crate`."""
    print(write_crate(Path(job.input.manifest).parent, job.output[0]))


if __name__ == "__main__":
    run_job(main)
