"""``python -m skanfis.gyro``, and the script ``skanfis-gyro``."""

import signal
import sys


def main(arguments=None):
    """Run the command; returns its exit code. While libraries load, Ctrl-C ends it in silence."""
    signal.signal(signal.SIGINT, signal.SIG_DFL)
    from . import command

    return command.main(arguments)


if __name__ == "__main__":
    sys.exit(main())
