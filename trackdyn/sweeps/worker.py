"""A process that computes rows: one a line comes in, its result goes out. It ends with the process that started it."""

import json
import os
import sys
from importlib import import_module
from queue import SimpleQueue
from threading import Thread


def _read(lines: SimpleQueue) -> None:
    """Pass lines on; at the end of the input whoever started this is done or dead, and so is this."""
    for line in sys.stdin:
        lines.put(line)
    os._exit(0)


def main() -> None:
    """Compute until the input ends."""
    answers = os.fdopen(os.dup(1), "w", encoding="utf-8")
    os.dup2(2, 1)  # whatever else is printed must not mix with the answers
    lines: SimpleQueue = SimpleQueue()
    Thread(target=_read, args=(lines,), daemon=True).start()
    from trackdyn.sweeps.engine import READY, outcome

    module, maker, memory = sys.argv[1:]
    compute = getattr(import_module(module), maker)(float(memory))
    print(READY, file=answers, flush=True)
    while True:
        print(json.dumps(outcome(compute, *json.loads(lines.get()))), file=answers, flush=True)


if __name__ == "__main__":
    main()
