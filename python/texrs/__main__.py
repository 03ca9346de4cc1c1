"""Run the command ``texrs`` as ``python -m texrs``."""

import signal
import sys
from collections.abc import Sequence


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command line and return its exit code.

    Ctrl-C ends it without a traceback, even while modules are imported.
    """
    try:
        try:
            from texrs.cli import main as run

            return run(arguments)
        finally:
            if arguments is None:
                # The command has finished or cleaned up, and its exit code is final, so ignore a late Ctrl-C.
                signal.signal(signal.SIGINT, signal.SIG_IGN)
    except KeyboardInterrupt:
        print("texrs: stopped; no incomplete files are left", file=sys.stderr)
        return 130


if __name__ == "__main__":
    sys.exit(main())
