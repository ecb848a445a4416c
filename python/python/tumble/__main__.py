"""The command line: ``tumble`` or ``python -m tumble``. See ``tumble --help`` and ``tumble audit --help``."""

import signal
import sys

from ._tumble import command_line


def main() -> int:
    """Runs the command line with the arguments of the process, and returns the exit code."""
    # A run ends at Ctrl-C with its files; Python would raise KeyboardInterrupt after that.
    signal.signal(signal.SIGINT, signal.SIG_DFL)
    if sys.argv[1:2] == ["audit"]:
        from . import _audit_command

        return _audit_command.main(sys.argv[2:])
    return command_line(["tumble", *sys.argv[1:]])


if __name__ == "__main__":
    sys.exit(main())
