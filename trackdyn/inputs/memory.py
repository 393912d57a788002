"""Free memory of this process: of the machine, its control groups, and its own limits."""

from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path

CONTROL_GROUPS, MEMBERSHIP = Path("/sys/fs/cgroup"), Path("/proc/self/cgroup")


def free_memory() -> float:
    """Return the memory that is free for this process, bytes."""
    return max(min([_free_in_machine(), *_free_in_control_groups(), *_free_address_space()]), 0)


def _free_in_machine() -> float:
    """Return the memory that the system has left; on Linux without psutil, whose import takes longer than the file."""
    with suppress(OSError, LookupError):
        rows = dict(row.split(":") for row in Path("/proc/meminfo").read_text().splitlines())
        return 1024.0 * int(rows["MemAvailable"].split()[0])
    from psutil import virtual_memory

    return float(virtual_memory().available)


def _free_in_control_groups(groups: Path = CONTROL_GROUPS, membership: Path = MEMBERSHIP) -> Iterator[float]:
    """Yield the free memory, file cache included, of each control group of this process that has a limit."""
    with suppress(OSError, ValueError):
        for line in membership.read_text(encoding="utf-8").splitlines():
            _, controllers, place = line.split(":", 2)
            if controllers == "":  # version 2
                names = "memory.max", "memory.current", "inactive_file"
                top = groups
            elif "memory" in controllers.split(","):
                names = "memory.limit_in_bytes", "memory.usage_in_bytes", "total_inactive_file"
                top = groups / "memory"
            else:
                continue
            group = top / place.lstrip("/")
            # the top of a container may be below the group that is named
            for folder in [group, *group.parents]:
                if folder.is_relative_to(top):
                    with suppress(OSError, ValueError, KeyError):  # no such group here, or no limit ("max")
                        limit, used = (int((folder / name).read_text()) for name in names[:2])
                        counts = dict(row.split() for row in (folder / "memory.stat").read_text().splitlines())
                        yield limit - used + int(counts[names[2]])


def _free_address_space() -> Iterator[float]:
    """Yield the address space left by `ulimit -v`."""
    with suppress(ImportError):  # not on every system
        import resource

        limit, _ = resource.getrlimit(resource.RLIMIT_AS)
        if limit != resource.RLIM_INFINITY:
            from psutil import Process

            yield limit - Process().memory_info().vms
