"""CITATION.cff has the fields that version 1.2.0 of the format asks for, and says of the paper what the README says."""

import re
from pathlib import Path

import yaml

from trackdyn import __version__

ROOT = Path(__file__).parents[1]
CITATION = yaml.safe_load((ROOT / "CITATION.cff").read_text(encoding="utf-8"))
README = " ".join((ROOT / "README.md").read_text(encoding="utf-8").split())
# of the schema of version 1.2.0: fields of a file, of a person, of a group, of a reference as far as they are used
REQUIRED = {"authors", "cff-version", "message", "title"}
FIELDS = REQUIRED | {
    "abstract",
    "commit",
    "contact",
    "date-released",
    "doi",
    "identifiers",
    "keywords",
    "license",
    "license-url",
    "preferred-citation",
    "references",
    "repository",
    "repository-artifact",
    "repository-code",
    "type",
    "url",
    "version",
}
PERSON = {
    "address",
    "affiliation",
    "alias",
    "city",
    "country",
    "email",
    "family-names",
    "fax",
    "given-names",
    "name-particle",
    "name-suffix",
    "orcid",
    "post-code",
    "region",
    "tel",
    "website",
}
GROUP = PERSON - {"affiliation", "family-names", "given-names", "name-particle", "name-suffix"} | {
    "name",
    "date-start",
    "date-end",
    "location",
}
REFERENCE = {"authors", "doi", "journal", "notes", "scope", "title", "type", "year"}


def test_the_fields_are_those_of_the_format():
    assert CITATION["cff-version"] == "1.2.0"
    assert REQUIRED <= CITATION.keys() <= FIELDS
    assert CITATION["type"] == "software" and CITATION["license"] == "MIT"
    assert CITATION["version"] == __version__
    assert len(set(CITATION["keywords"])) == len(CITATION["keywords"]) > 0
    for reference in CITATION["references"]:
        assert {"authors", "title", "type"} <= reference.keys() <= REFERENCE
        for author in [*reference["authors"], *CITATION["authors"]]:
            assert ("name" in author and author.keys() <= GROUP) or (
                "family-names" in author and author.keys() <= PERSON
            )


def test_the_paper_is_the_reference():
    (paper,) = CITATION["references"]
    assert paper["type"] == "article" and re.fullmatch(r"10\.\d{4,}/\S+", paper["doi"])
    assert f"*{paper['title']}*" in README and f"doi {paper['doi']}" in README
    authors = ", ".join(author["family-names"] for author in paper["authors"])
    assert f"({authors}; {paper['journal']}, {paper['year']}" in README
    assert CITATION["title"].startswith("trackdyn")
