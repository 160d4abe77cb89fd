"""Entry point of ``python -m skanfis.gyro`` and of the script ``skanfis-gyro``."""

import signal
import sys


def main(arguments=None):
    """Run the command and return its exit code; while libraries load, Ctrl-C ends it silently."""
    signal.signal(signal.SIGINT, signal.SIG_DFL)
    from . import command

    return command.main(arguments)


if __name__ == "__main__":
    sys.exit(main())
