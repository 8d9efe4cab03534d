"""Wall touches as a recording of master and slave has them."""

import csv

import numpy as np

HEADS = ("time_s", "master_angle_rad", "master_torque_N*m", "slave_angle_rad", "slave_torque_N*m")


def write_touch(path, *columns, heads=HEADS):
    """Write the table of a wall touch, and return its file."""
    with path.open("w", newline="") as file:
        rows = csv.writer(file)
        rows.writerow(heads)
        rows.writerows(zip(*columns, strict=True))
    return path


def touch(stiffness=12.0, wall=95.0, friction=0.1, noise=0.0, seed=1):
    """A hand that moves to and fro in free motion, then presses on a wall and lets go: columns of the table."""
    time = np.arange(0, 6, 0.01)
    free = time < 3
    torque = np.where(free, friction * np.sign(np.sin(2 * np.pi * time)), np.sin(np.pi * (time - 3) / 3).clip(0))
    noisy = np.random.default_rng(seed).normal(0, noise, (2, len(time)))
    master = np.where(free, 0.1 * np.cos(2 * np.pi * time), 0.2 + torque / stiffness)
    slave = np.where(free, 0.1 * np.cos(2 * np.pi * time), 0.2 + torque / wall)
    pressed = np.where(free, 0.0, torque)
    return time, master, torque + noisy[0], slave, pressed + noisy[1]
