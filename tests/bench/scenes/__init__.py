"""Random scenes: how often each way of keeping clear reaches its goal (./dev bench scenes)."""
