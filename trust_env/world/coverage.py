"""Which part of the area each FOV covers, on a grid of cells over all FOVs."""

from __future__ import annotations

from trust_env.compiled.kernels import kernel
from trust_env.world.fov import contains

SIDE = 40  # cells along each side of the grid
CELLS = SIDE * SIDE  # Q


@kernel
def cover(world):
    """Fill `covered[K, Q]` and `cell_area`, again whenever an agent has moved."""
    pose, known, moved = world.agents.pose, world.evidence.covered_pose, False
    for k in range(pose.shape[0]):
        for axis in range(3):
            moved |= known[k, axis] != pose[k, axis]  # NaN, at first, differs from everything
            known[k, axis] = pose[k, axis]
    if moved:
        _cover_cells(world)


@kernel
def _cover_cells(world):
    """Row by row from below, over the box that holds all FOVs."""
    box, covered = world.agents.fov_box, world.evidence.covered
    x0, x1, y0, y1 = box[0, 0], box[0, 1], box[0, 2], box[0, 3]
    for k in range(1, box.shape[0]):
        x0, x1, y0, y1 = min(x0, box[k, 0]), max(x1, box[k, 1]), min(y0, box[k, 2]), max(y1, box[k, 3])
    width, height = (x1 - x0) / SIDE, (y1 - y0) / SIDE
    world.evidence.cell_area = width * height
    for k in range(covered.shape[0]):
        for row in range(SIDE):
            for column in range(SIDE):
                x, y = x0 + (column + 0.5) * width, y0 + (row + 0.5) * height
                covered[k, row * SIDE + column] = contains(world, k, x, y)


@kernel
def forget_coverage(world):
    """An episode begins: the agents stand elsewhere."""
    known = world.evidence.covered_pose
    for k in range(known.shape[0]):
        for axis in range(3):
            known[k, axis] = float("nan")
