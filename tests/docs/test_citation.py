"""The two citation files say the same."""

import re

import yaml

from tests.conftest import ROOT


def test_bibtex_has_the_entries_of_the_citation_file():
    cff = yaml.safe_load((ROOT / "CITATION.cff").read_text(encoding="utf-8"))
    software, article = (ROOT / "CITATION.bib").read_text(encoding="utf-8").split("\n\n")
    for of, entry in ((cff, software), (cff["references"][0], article)):
        fields = dict(re.findall(r"^  (\w+) +=\s+\{(.*)\},$", entry, re.MULTILINE))
        for name in fields.keys() - {"author"}:
            assert fields[name] == str(of[name]), name
        names = [author.get("name") or f"{author['family-names']}, {author['given-names']}" for author in of["authors"]]
        assert fields["author"].strip("{}") == " and ".join(names)
