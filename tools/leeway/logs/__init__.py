"""Reading logs: messages as columns, the motion in them, and its numbers."""
