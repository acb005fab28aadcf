"""How long a whole tick takes (./dev bench tick)."""
