"""The real-time bench: Leeway's loop and bus against cyclictest and bare UDP, as ratios.

One session alternates short slices of each under the same load. What is compared was measured side
by side; numbers of different sessions say nothing about each other.
"""
