"""`python -m leeway` is the command `leeway`."""

from leeway.cli import main

main()
