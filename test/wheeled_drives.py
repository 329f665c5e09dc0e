"""Made-up drives of a robot on two wheels."""

import numpy as np

from control_field.drives.dead_reckoning import Motion


def driven(seed, rate, seconds=40.0, speed=0.22, turning=0.6):
    """Return stamps, places and headings with speeds of a robot that starts, turns and stops."""
    rng, dt = np.random.default_rng(seed), 0.02
    n = int(seconds / dt)
    wished = [np.repeat(rng.choice(of, 1 + n // 100), 100)[:n] for of in (
        [0.0, speed, speed, -0.5 * speed], [0.0, 0.0, turning, -turning])]
    v, w = (np.convolve(each, np.full(25, 0.04))[:n] for each in wished)
    yaw = np.cumsum(w) * dt
    xy = np.cumsum(v[:, np.newaxis] * dt * np.stack([np.cos(yaw), np.sin(yaw)], axis=1), axis=0)
    every = slice(None, None, round(1.0 / rate / dt))
    velocity = np.stack([v, 0.0 * v], axis=1)
    return 100.0 + np.arange(n)[every] * dt, xy[every], Motion(yaw[every], velocity[every])


def ahead(turn):
    return np.array([np.cos(turn), np.sin(turn)])
