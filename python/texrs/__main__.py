"""``python -m texrs`` is the command ``texrs``."""

import signal
import sys
from collections.abc import Sequence


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command line and return its exit code; Ctrl-C ends it without a traceback while it still loads, too."""
    try:
        try:
            from texrs.cli import main as run

            return run(arguments)
        finally:
            if arguments is None:
                # All is done, or cleared away: the process is on its way out, and its exit code says how it went.
                signal.signal(signal.SIGINT, signal.SIG_IGN)
    except KeyboardInterrupt:
        print("texrs: stopped; nothing was left half-written", file=sys.stderr)
        return 130


if __name__ == "__main__":
    sys.exit(main())
