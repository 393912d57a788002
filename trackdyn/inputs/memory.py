"""Free memory of this process: of the machine, its control groups, and its own limits."""

from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path

from psutil import Process, virtual_memory

CONTROL_GROUPS, MEMBERSHIP = Path("/sys/fs/cgroup"), Path("/proc/self/cgroup")


def free_memory() -> float:
    """Return the memory that is free for this process, bytes."""
    return max(min([virtual_memory().available, *_free_in_control_groups(), *_free_address_space()]), 0)


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
            yield limit - Process().memory_info().vms
