"""Logs again: every tick recomputed from its recorded inputs, and messages sent once more."""
