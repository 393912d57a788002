"""``python -m trackdyn.synthetic``: write the data set."""

import argparse

from trackdyn.synthetic import SPEEDS, fit
from trackdyn.synthetic.dataset import write_dataset


def main(argv=None) -> None:
    """Write the data set, or print what :func:`fit` gives for every speed."""
    parser = argparse.ArgumentParser(prog="python -m trackdyn.synthetic", description=main.__doc__)
    parser.add_argument("--out", default="data/synthetic", help="folder to write (default: %(default)s)")
    parser.add_argument("--fit", action="store_true", help="print the fitted constants, write nothing")
    arguments = parser.parse_args(argv)
    if arguments.fit:
        for speed in SPEEDS.values():
            print(fit(speed))
    else:
        print(write_dataset(arguments.out).round(4).to_string())


if __name__ == "__main__":
    main()
