"""`leeway` and `python -m leeway`."""

from leeway import interrupt


def main() -> None:
    """Entry point: the command line, whose imports take a moment."""
    interrupt.end_quietly()
    from leeway.cli import app

    app()


if __name__ == "__main__":
    main()
