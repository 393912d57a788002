"""Memory that is free: the least of the machine's, the control groups' and the limits of the process."""

import resource

import pytest

from tests.conftest import python, written
from trackdyn.inputs import memory

MACHINE = 8e9
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
    (VERSION_2, "0::/job/step", 1.6e9),
    (VERSION_2, "0::/", MACHINE),
    (VERSION_1, "3:cpu,cpuacct:/job\n4:memory:/job\n0::/", 0.75e9),
    (IN_CONTAINER, "4:memory:/docker/0123", 0.75e9),  # the host's name of the container's top
    (VERSION_1, "3:cpu:/job", MACHINE),
    ({**VERSION_2, "job/memory.current": "3000000000"}, "0::/job", 0),
    ({**VERSION_2, "job/memory.max": "damaged"}, "0::/job", MACHINE),
    ({}, "0::/job", MACHINE),
    ({}, "no control groups", MACHINE),
])  # fmt: skip
def test_the_limit_of_a_control_group_counts(tmp_path, monkeypatch, files, membership, free):
    for name, text in files.items():
        (tmp_path / "groups" / name).parent.mkdir(parents=True, exist_ok=True)
        written(tmp_path / "groups" / name, text)
    places = tmp_path / "groups", written(tmp_path / "membership", membership)
    monkeypatch.setattr(memory._free_in_control_groups, "__defaults__", places)
    monkeypatch.setattr(memory, "_free_in_machine", lambda: MACHINE)
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
