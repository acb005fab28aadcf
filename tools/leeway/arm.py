"""Kinematics of a robot, for any array-like configurations."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from leeway import _native

Array = npt.NDArray[np.float64]


class Arm:
    """Kinematics of a six-joint UR arm from its DH table, computed by the controller's own code.

    Everything is in the base frame of the arm (its DH base); frame 6 is the flange, the tip.

    Parameters
    ----------
    name
        "ur5" or "ur10".

    Raises
    ------
    ValueError
        Unknown name; in the methods, a q of another shape or with a value that is not finite.
    """

    def __init__(self, name: str) -> None:
        self._native = _native.Arm(name)
        self.name = name

    def fk(self, q: npt.ArrayLike) -> Array:
        """Return the pose of the tip: q (..., 6) rad -> (..., 4, 4), translation in m."""
        return self._native.fk(np.asarray(q, dtype=np.float64))

    def frames(self, q: npt.ArrayLike) -> Array:
        """Return the poses of the DH frames 1 to 6: q (..., 6) rad -> (..., 6, 4, 4)."""
        return self._native.frames(np.asarray(q, dtype=np.float64))

    def jacobian(self, q: npt.ArrayLike) -> Array:
        """Return the geometric Jacobian of the tip: q (..., 6) rad -> (..., 6, 6).

        Linear rows (m/rad) come first, axes are those of the base.
        """
        return self._native.jacobian(np.asarray(q, dtype=np.float64))
