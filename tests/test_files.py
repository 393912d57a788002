"""The project writes every file to a temporary file and renames it, so that no reader finds half of one."""

import os

import pytest

from tests.conftest import python, refused
from trackdyn.inputs.files import MACHINE, check_writable, remove_abandoned, replacing, write_text


def test_an_interrupted_write_leaves_the_old_file(tmp_path):
    target = tmp_path / "a.txt"
    write_text(target, "whole")
    with pytest.raises(ZeroDivisionError), replacing(target) as temporary:
        temporary.write_text("x" * 10**6)
        1 / 0  # noqa: B018
    assert target.read_text() == "whole"
    assert [path.name for path in tmp_path.iterdir()] == ["a.txt"]


def test_only_files_of_ended_processes_are_removed(tmp_path):
    write = """
import os, sys
from trackdyn.inputs.files import replacing
with replacing(sys.argv[1]) as part:
    part.touch()
    os._exit(0)
"""
    (tmp_path / "deep").mkdir()
    for name in ("a.csv", "deep/b", "deep/archive.tar.gz"):
        python(write, tmp_path / name)
    left = {path.name for path in tmp_path.rglob(".*part*")}
    assert len(left) == 3
    foreign = (".iso.part", ".thesis.part2.docx", ".a.123-456.part.csv", ".a.trackdyn-part.csv")
    elsewhere = next(iter(left)).replace(MACHINE, "00000000")  # of another machine, where the process may run
    for name in (*foreign, elsewhere):
        (tmp_path / "deep" / name).touch()
    with replacing(tmp_path / "c.csv") as ours:
        ours.touch()
        remove_abandoned(tmp_path)
        assert {path.name for path in tmp_path.rglob(".*")} == {*foreign, elsewhere, ours.name}
    remove_abandoned(tmp_path / "no folder")


def test_the_target_of_a_link_is_written_and_the_mode_is_kept(tmp_path):
    (tmp_path / "there").mkdir()
    target, link = tmp_path / "there" / "big.txt", tmp_path / "a.txt"
    link.symlink_to(target)
    for text, mode in (("one", 0o600), ("two", 0o640)):  # the link leads nowhere first
        write_text(link, text)
        assert link.is_symlink() and target.read_text() == text
        target.chmod(mode)
    write_text(link, "three")
    assert target.stat().st_mode & 0o777 == 0o640
    assert [path.name for path in target.parent.iterdir()] == ["big.txt"]


@pytest.mark.parametrize("write", [check_writable, lambda path: write_text(path, "x")])
def test_a_pipe_and_a_device_are_refused(tmp_path, write):
    os.mkfifo(tmp_path / "pipe")
    (tmp_path / "link").symlink_to("/dev/null")
    for path in (tmp_path / "pipe", tmp_path / "link", "/dev/null"):
        refused(write, path, match="is a pipe or a device, not a file; give the name of a file")
    assert (tmp_path / "pipe").is_fifo() and not os.path.isfile("/dev/null")
