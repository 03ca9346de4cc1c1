"""``python -m texrs`` is the command ``texrs``."""

import sys

from texrs.cli import main

if __name__ == "__main__":
    sys.exit(main())
