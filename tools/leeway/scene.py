"""Scenes, read and checked by the C code, and runs of them in this process."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from leeway import _native

Array = npt.NDArray[np.float64]


class Scene:
    """Everything a run is made of. Make one with `load_scene`."""

    def __init__(self, text: str, name: str, sets: tuple[str, ...] = ()) -> None:
        self._text = text
        self._sets = sets
        self.name = name
        self._native = _native.read_scene(text, name, list(sets))

    def with_(self, changes: Mapping[str, Any]) -> Scene:
        """Return a changed copy, checked like a file.

        Parameters
        ----------
        changes
            Values by dotted key, as in ``{"law.rho_rep": 0.8, "q0": [0, -1, 1, 0, 0, 0]}``.

        Raises
        ------
        ValueError
            A key is unknown or a value is refused; the text says which and why.
        """
        added = tuple(f"{key}={_yaml(value)}" for key, value in changes.items())
        return Scene(self._text, self.name, self._sets + added)

    def to_dict(self) -> dict[str, Any]:
        """Return all keys and values, defaults included; limits that are off are infinite."""
        return dict(self._native.to_dict())

    def to_yaml(self) -> str:
        """Return the whole scene as YAML that reads back to the same bits."""
        return self._native.to_yaml()


def _yaml(value: Any) -> str:
    """Write a Python value as YAML in one line, exact for floats."""
    if isinstance(value, Mapping):
        return "{" + ", ".join(f"{k}: {_yaml(v)}" for k, v in value.items()) + "}"
    if isinstance(value, (list, tuple, np.ndarray)):
        return "[" + ", ".join(_yaml(v) for v in value) + "]"
    if isinstance(value, (float, np.floating)):
        return repr(float(value))
    return str(value)


def load_scene(path_or_text: str | Path, sets: Sequence[str] = ()) -> Scene:
    """Read a scene.

    Parameters
    ----------
    path_or_text
        Path of a YAML file, or YAML text (recognised by its line breaks).
    sets
        Values that replace or add to it, ``"key=value"`` as on the command line.

    Raises
    ------
    ValueError
        The scene is refused; the text says file, line, key, what was expected and what was found.
    OSError
        The file cannot be read.
    """
    if isinstance(path_or_text, str) and "\n" in path_or_text:
        return Scene(path_or_text, "scene", tuple(sets))
    path = Path(path_or_text)
    try:
        return Scene(path.read_text(encoding="utf-8"), str(path), tuple(sets))
    except UnicodeDecodeError as error:
        raise ValueError(f"{path}: not a text file: {error.reason}") from error


@dataclass(frozen=True)
class Run:
    """A run in process; row k belongs to controller period k.

    Attributes
    ----------
    t : (n,) s
    q, qd : (n, 6) rad and rad/s, configuration and the velocity commanded at it
    tip : (n, 3) m
    deviation : (n,) m, tip to goal
    clearance : (n,) m, smallest distance of the arm, or of a moving control point, to an obstacle's
        surface; infinite without obstacles
    self_clearance : (n,) m, smallest distance of links watched against each other; infinite where
        none is near
    flags : (n,) what shaped the command, bits of joint_command_t
    outcome : (n,) how the law fared, law_outcome of joint_command_t: 1 ok, 2 no number, 3 stuck,
        4 aside
    """

    scene: Scene
    t: Array
    q: Array
    qd: Array
    tip: Array
    deviation: Array
    clearance: Array
    self_clearance: Array
    flags: npt.NDArray[np.int32]
    outcome: npt.NDArray[np.int32]


def simulate(scene: Scene | str | Path) -> Run:
    """Run a scene in this process: the controller's tick and the plant's step in turn.

    The numbers are those of a lockstep run over the bus, bit for bit. The GIL is released.

    Parameters
    ----------
    scene
        A scene, or what `load_scene` takes.

    Raises
    ------
    ValueError
        The scene has a law or robot that the C code does not know.
    """
    if not isinstance(scene, Scene):
        scene = load_scene(scene)
    return Run(scene=scene, **_native.simulate(scene._native))
