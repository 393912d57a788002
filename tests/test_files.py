"""Files are written to a temporary file and renamed, so that no reader finds half of one; memory that is free."""

import os
import resource

import pytest

from tests.conftest import python, refused, written
from trackdyn.inputs import memory
from trackdyn.inputs.files import MACHINE, check_writable, remove_abandoned, replacing, write_text


def test_an_interrupted_write_leaves_the_old_file(tmp_path):
    target = tmp_path / "a.txt"
    write_text(target, "whole")
    with pytest.raises(ZeroDivisionError), replacing(target) as temporary:
        temporary.write_text("x" * 10**6)
        1 / 0  # noqa: B018
    assert {path.name: path.read_text() for path in tmp_path.iterdir()} == {"a.txt": "whole"}


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


IN_MACHINE = 8e9
VERSION_2 = {
    "memory.max": "max", "memory.current": "7000000000", "memory.stat": "anon 5\ninactive_file 10\n",
    "job/memory.max": "2000000000", "job/memory.current": "500000000", "job/memory.stat": "inactive_file 100000000\n",
    "job/step/memory.max": "max", "job/step/memory.current": "5", "job/step/memory.stat": "inactive_file 0\n",
}  # fmt: skip
VERSION_1 = {
    "memory/job/memory.limit_in_bytes": "1000000000", "memory/job/memory.usage_in_bytes": "300000000",
    "memory/job/memory.stat": "cache 7\ntotal_inactive_file 50000000\n",
    "memory/memory.limit_in_bytes": "9223372036854771712", "memory/memory.usage_in_bytes": "1",
    "memory/memory.stat": "total_inactive_file 0\n",
}  # fmt: skip
IN_CONTAINER = {name.replace("/job/", "/"): text for name, text in list(VERSION_1.items())[:3]}


@pytest.mark.parametrize(("files", "membership", "free"), [
    (VERSION_2, "0::/job/step", 1.6e9), (VERSION_2, "0::/", IN_MACHINE), (VERSION_1, "3:cpu:/job", IN_MACHINE),
    (VERSION_1, "3:cpu,cpuacct:/job\n4:memory:/job\n0::/", 0.75e9),
    (IN_CONTAINER, "4:memory:/docker/0123", 0.75e9),  # the host's name of the container's top
    ({**VERSION_2, "job/memory.current": "3000000000"}, "0::/job", 0),
    ({**VERSION_2, "job/memory.max": "damaged"}, "0::/job", IN_MACHINE),
    ({}, "0::/job", IN_MACHINE), ({}, "no control groups", IN_MACHINE),
])  # fmt: skip
def test_the_limit_of_a_control_group_counts(tmp_path, monkeypatch, files, membership, free):
    for name, text in files.items():
        (tmp_path / "groups" / name).parent.mkdir(parents=True, exist_ok=True)
        written(tmp_path / "groups" / name, text)
    places = tmp_path / "groups", written(tmp_path / "membership", membership)
    monkeypatch.setattr(memory._free_in_control_groups, "__defaults__", places)
    monkeypatch.setattr(memory, "_free_in_machine", lambda: IN_MACHINE)
    monkeypatch.setattr(memory, "_free_address_space", lambda: [])
    assert memory.free_memory() == free


def test_the_limit_of_the_address_space_counts():
    code = (
        "import psutil, resource; from trackdyn.inputs.memory import free_memory; "
        f"resource.setrlimit(resource.RLIMIT_AS, (10**9, {resource.RLIM_INFINITY})); "
        "print(free_memory(), psutil.Process().memory_info().vms)"
    )
    free, taken = map(float, python(code).out.split())
    assert 0 < free <= 10**9 - 0.9 * taken
