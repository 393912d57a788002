"""``python -m trackdyn`` is the command ``trackdyn``."""

from trackdyn_command import main

main()
