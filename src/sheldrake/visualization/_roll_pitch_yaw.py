"""Quaternions among logged elements as roll, pitch and yaw."""

from __future__ import annotations

import numpy as np


def with_roll_pitch_yaw(names: list[str], data: np.ndarray) -> tuple[list[str], np.ndarray]:
    """Names and rows in which every quaternion `stem_qw ... stem_qz` has become `stem_roll`, `_pitch`, `_yaw` [rad].

    Angles are without jumps over time. Elements that belong to no complete quaternion stay as they are.
    """
    place = {name: i for i, name in enumerate(names)}
    new_names: list[str] = []
    rows: list[np.ndarray] = []
    for i, name in enumerate(names):
        stem = name[:-2]
        parts = [place.get(f"{stem}q{axis}") for axis in "wxyz"] if name[-3:-1] == "_q" and name[-1] in "wxyz" else []
        if not parts or None in parts:
            new_names.append(name)
            rows.append(data[i])
        elif name.endswith("qw"):
            angles = roll_pitch_yaw(data[parts])  # type: ignore[index]
            new_names += [f"{stem}{angle}" for angle in ("roll", "pitch", "yaw")]
            rows += list(np.unwrap(angles, axis=1)) if angles.shape[1] else list(angles)
    return new_names, np.array(rows)


def roll_pitch_yaw(q: np.ndarray) -> np.ndarray:
    """Space-fixed roll, pitch, yaw [rad], shape (3, n), of quaternions w, x, y, z of any length, shape (4, n)."""
    w, x, y, z = q / np.maximum(np.linalg.norm(q, axis=0), 1e-300)
    roll = np.arctan2(2.0 * (w * x + y * z), 1.0 - 2.0 * (x * x + y * y))
    pitch = np.arcsin(np.clip(2.0 * (w * y - z * x), -1.0, 1.0))
    yaw = np.arctan2(2.0 * (w * z + x * y), 1.0 - 2.0 * (y * y + z * z))
    return np.array([roll, pitch, yaw])
