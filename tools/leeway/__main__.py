"""`leeway` and `python -m leeway`."""

import errno
import sys

from leeway import interrupt


def main() -> None:
    """Entry point: the command line, whose imports take a moment."""
    interrupt.end_quietly()
    from leeway.cli import app

    try:
        try:
            app()
        finally:
            if sys.stdout is not None:
                sys.stdout.flush()
    except OSError as error:
        if error.errno != errno.ENOSPC:
            raise
        sys.stdout = None  # nor may the interpreter try once more
        sys.exit(f"leeway: cannot write: {error.strerror}")


if __name__ == "__main__":
    main()
