"""Bench of the distance queries: ours against coal's, in one run, in turns."""
