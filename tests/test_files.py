"""Every file that the project writes is written beside its place and renamed, so that no reader finds half of one."""

import pytest

from trackdyn.errors import InputError
from trackdyn.files import replacing, write_csv, write_text


@pytest.mark.parametrize("size", [10, 10**6])
def test_what_breaks_off_leaves_what_was_there(tmp_path, size):
    place = tmp_path / "a.txt"
    write_text(place, "whole")
    with pytest.raises(ZeroDivisionError), replacing(place) as part:
        part.write_text("x" * size)
        1 / 0  # noqa: B018
    assert place.read_text() == "whole"
    assert [path.name for path in tmp_path.iterdir()] == ["a.txt"]


def test_a_file_in_place_of_a_folder_is_said(tmp_path):
    (tmp_path / "file").touch()
    with pytest.raises(
        InputError, match=r"file/a\.txt: cannot be written \(.*\); free disk space or choose another folder"
    ):
        write_text(tmp_path / "file" / "a.txt", "x")


def test_a_table_keeps_its_newlines(tmp_path):
    pd = pytest.importorskip("pandas")
    write_csv(tmp_path / "new" / "a.csv", pd.DataFrame({"a": [1.23456789], "b": ["ä"]}), float_format="%.3g")
    assert (tmp_path / "new" / "a.csv").read_bytes() == "a,b\n1.23,ä\n".encode()
