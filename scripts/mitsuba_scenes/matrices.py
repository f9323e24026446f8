"""Transforms as 4 x 4 matrices, of columns of points."""

import numpy as np


def translation(offset):
    matrix = np.eye(4)
    matrix[:3, 3] = offset
    return matrix


def scaling(factors):
    if not np.all(factors):
        raise ValueError("by zero")
    return np.diag([*factors, 1.0])


def rotation(axis, degrees):
    """By the right-hand rule."""
    length = np.linalg.norm(axis)
    if not length > 0:
        raise ValueError("has no axis")
    x, y, z = axis / length
    skew = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    angle = np.radians(degrees)
    matrix = np.eye(4)
    matrix[:3, :3] += np.sin(angle) * skew + (1 - np.cos(angle)) * skew @ skew
    return matrix


def look_at(origin, target, up):
    """From the space of a camera that looks along +z, +y being up and +x to the left."""
    if not np.any(target - origin):
        raise ValueError("has its target at its origin")
    forward = (target - origin) / np.linalg.norm(target - origin)
    if not np.any(up):
        up = np.eye(3)[np.argmin(np.abs(forward))]
    left = np.cross(up, forward)
    if not np.linalg.norm(left) > 1e-12 * np.linalg.norm(up):
        raise ValueError("has its up along its direction")
    left /= np.linalg.norm(left)
    matrix = np.eye(4)
    matrix[:3] = np.stack([left, np.cross(forward, left), forward, origin], axis=1)
    return matrix


def from_numbers(numbers):
    """Row by row; of nine numbers, without a translation."""
    side = 4 if len(numbers) == 16 else 3
    matrix = np.eye(4)
    matrix[:side, :side] = numbers.reshape(side, side)
    if not np.array_equal(matrix[3], (0, 0, 0, 1)):
        raise ValueError("is not affine: its last row is not 0 0 0 1")
    if np.linalg.matrix_rank(matrix) < 4:
        raise ValueError("is singular")
    return matrix


def points(matrix, places):
    return np.asarray(places, float) @ matrix[:3, :3].T + matrix[:3, 3]


def directions(matrix, vectors):
    return np.asarray(vectors, float) @ matrix[:3, :3].T
