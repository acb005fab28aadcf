"""Leeway: gives a robot arm room.

Kinematics, distances, scenes and in-process runs come from the same C code that the controller
runs. Units are SI, angles radians; positions are in the base frame of the arm (its DH base).

>>> import leeway
>>> arm = leeway.Arm("ur5")
>>> arm.fk([0, 0, 0, 0, 0, 0]).shape
(4, 4)
"""

import importlib
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from leeway._native import BUILD
    from leeway.arm import Arm
    from leeway.clearance import clearance
    from leeway.logs.log import read_log
    from leeway.scene import Run, Scene, load_scene, simulate
    from leeway.shapes import Box, Capsule, Distance, HalfSpace, Hull, Shape, Sphere, distance

__all__ = [
    "BUILD",
    "Arm",
    "Box",
    "Capsule",
    "Distance",
    "HalfSpace",
    "Hull",
    "Run",
    "Scene",
    "Shape",
    "Sphere",
    "clearance",
    "distance",
    "load_scene",
    "read_log",
    "simulate",
]

# Modules are loaded when a name of theirs is first used: `leeway stop` need not wait for NumPy.
_HOMES = {
    "leeway._native": ("BUILD",),
    "leeway.arm": ("Arm",),
    "leeway.clearance": ("clearance",),
    "leeway.logs.log": ("read_log",),
    "leeway.scene": ("Run", "Scene", "load_scene", "simulate"),
    "leeway.shapes": (
        *("Box", "Capsule", "Distance", "HalfSpace", "Hull", "Shape", "Sphere"),
        "distance",
    ),
}


def __getattr__(name: str) -> Any:
    for module, names in _HOMES.items():
        if name in names:
            globals()[name] = getattr(importlib.import_module(module), name)
            return globals()[name]
    raise AttributeError(f"module 'leeway' has no attribute {name!r}")


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__})
