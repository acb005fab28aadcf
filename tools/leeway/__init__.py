"""Leeway: gives a robot arm room.

Kinematics, scenes and in-process runs come from the same C code that the controller runs.
Units are SI, angles radians; positions are in the base frame of the arm (its DH base).

>>> import leeway
>>> arm = leeway.Arm("ur5")
>>> arm.fk([0, 0, 0, 0, 0, 0]).shape
(4, 4)
"""

from leeway._native import BUILD
from leeway.arm import Arm
from leeway.logs.log import read_log
from leeway.scene import Run, Scene, load_scene, simulate

__all__ = ["BUILD", "Arm", "Run", "Scene", "load_scene", "read_log", "simulate"]
