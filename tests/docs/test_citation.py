"""What stands twice says the same: citation files, and the badges of the README."""

import re
import tomllib

import yaml

from tests.conftest import ROOT

CFF = yaml.safe_load((ROOT / "CITATION.cff").read_text(encoding="utf-8"))


def test_bibtex_has_what_the_citation_file_has():
    software, article = (ROOT / "CITATION.bib").read_text(encoding="utf-8").split("\n\n")
    for of, entry in ((CFF, software), (CFF["references"][0], article)):
        fields = dict(re.findall(r"^  (\w+) +=\s+\{(.*)\},$", entry, re.MULTILINE))
        for name in fields.keys() - {"author"}:
            assert fields[name] == str(of[name]), name
        names = [author.get("name") or f"{author['family-names']}, {author['given-names']}" for author in of["authors"]]
        assert fields["author"].strip("{}") == " and ".join(names)


def test_badges_say_what_the_project_says():
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    said = {
        path.stem: re.search("<title>(.*)</title>", path.read_text(encoding="utf-8"))[1]
        for path in (ROOT / "docs" / "pictures" / "badges").glob("*.svg")
    }
    versions = said.pop("python").partition(": ")[2].split(" | ")
    assert f">={versions[0]}" in project["requires-python"]
    assert {f"Programming Language :: Python :: {v}" for v in versions} <= set(project["classifiers"])
    assert said == {"licence": f"licence: {CFF['license']}"}
