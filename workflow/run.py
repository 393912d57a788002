"""Snakemake in this checkout, from any folder, after a check of configurations, in which it would run templates."""

import os
import sys
from collections.abc import Iterator
from contextlib import contextmanager, redirect_stderr, redirect_stdout, suppress
from io import StringIO
from pathlib import Path
from tempfile import NamedTemporaryFile

ROOT = Path(__file__).resolve().parents[1]


def configurations(arguments: list[str]) -> list[Path]:
    """Return the files of ``--configfile``, also those that a profile names."""
    from snakemake.cli import parse_args

    # Snakemake itself prints the help, and any mistake in the arguments
    with suppress(SystemExit), redirect_stdout(StringIO()), redirect_stderr(StringIO()):
        return list(parse_args(arguments)[1].configfile or [])
    return []


@contextmanager
def dearest_jobs(count: int = 5) -> Iterator[None]:
    """Print at the end of a run which of its jobs took most CPU time, and the kernels that they compiled."""
    from trackdyn.sweeps.snakemake_job import COMPILED, COSTS

    with NamedTemporaryFile("r", encoding="utf-8") as file:
        os.environ[COSTS] = file.name
        try:
            yield
        finally:
            lines = [line.rstrip().split(maxsplit=1) for line in file]
            costs = sorted(((float(seconds), name) for seconds, name in lines), reverse=True)
            kernels = [(seconds, name.removeprefix(COMPILED)) for seconds, name in costs if name.startswith(COMPILED)]
            jobs = [cost for cost in costs if not cost[1].startswith(COMPILED)]
            if jobs:
                total = sum(seconds for seconds, _ in jobs)
                print(f"{len(jobs)} jobs took {total:.0f} CPU s; those that took most, by their logs:")
                print(*(f"{seconds:10.1f}  {log}" for seconds, log in jobs[:count]), sep="\n", flush=True)
            if kernels:
                total, different = sum(seconds for seconds, _ in kernels), len({name for _, name in kernels})
                print(f"{len(kernels)} compilations, {different} of them different, took {total:.0f} CPU s of that:")
                print(*(f"{seconds:10.1f}  {name}" for seconds, name in kernels), sep="\n", flush=True)


def main(arguments: list[str]) -> None:
    """Read the configurations, then run Snakemake."""
    from platformdirs import user_cache_dir
    from snakemake.cli import main as snakemake

    from trackdyn.inputs.errors import InputError
    from trackdyn_replication.pipeline.config import read_layer

    try:
        Path(user_cache_dir("snakemake")).mkdir(parents=True, exist_ok=True)
    except OSError as error:  # in Snakemake a traceback
        raise InputError(
            f"{error.filename}: cannot be made ({error.strerror}), and Snakemake needs a cache there; set "
            "XDG_CACHE_HOME to a folder that can be written"
        ) from None
    if Path.cwd() != ROOT:  # options of the user come later, and win
        arguments = [f"--snakefile={ROOT / 'Snakefile'}", f"--directory={ROOT}", *arguments]
    for file in configurations(arguments):
        read_layer(file)
    with dearest_jobs():
        snakemake(arguments)


if __name__ == "__main__":
    try:
        from trackdyn.inputs.errors import TrackdynError

        try:
            main(sys.argv[1:])
        except TrackdynError as error:
            sys.exit(str(error))
    except KeyboardInterrupt:
        sys.exit("interrupted; the same command goes on")
