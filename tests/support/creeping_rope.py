"""Recordings of a rope whose friction builds up after a turn, by an ODE solver that shares no code with the package.

Textbook LuGre (Canudas de Wit et al. 1995) with the motion of the load end, u = log F_out, in place of a displacement:
z' = u' - stiffness |u'| z / g(v), friction = stiffness z + damping z'. With no damping and a constant g it is Dahl's model.
With damping the load end has a small damper, without which its speed would be a quotient of zeros while the rope slides.
"""

from dataclasses import dataclass

import numpy as np
from scipy.integrate import solve_ivp

LOAD_DAMPER = 2e-5  # s; the output comes later by that


@dataclass(frozen=True)
class Truth:
    """Friction exponent at the reference speed; stiffness over it (1/s per log force), damping over stiffness [s]; rate."""

    exponent: float = 0.3
    stiffness: float = 25.0
    damping: float = 0.0
    stribeck: float = 0.0
    stribeck_speed: float = 15.0
    viscous: float = 0.0
    reference_speed: float = 0.0

    def steady(self, speed):
        """Friction exponent in steady sliding."""
        a, v_s, c = self.stribeck, self.stribeck_speed, self.viscous
        factors = [1 + a * np.exp(-((v / v_s) ** 2)) + c * np.abs(v) for v in (speed, self.reference_speed)]
        return self.exponent * factors[0] / factors[1]


def pulled(time, periods=(9.0, 5.0, 3.0), low=20.0, high=90.0, speed_of=60.0):
    """Input force [N] and speed of the rope [mm/s] of strokes to and fro, two of each period, without jumps."""
    middle, half = (low + high) / 2, (high - low) / 2
    phase, ends = np.zeros_like(time), np.cumsum([2 * p for p in periods])
    rate = np.zeros_like(time)
    start, whole = 0.0, 0
    for period, end in zip(periods, ends, strict=True):
        now = (time >= start) & (time < end)
        phase[now], rate[now] = whole + (time[now] - start) / period, 1 / period
        start, whole = end, whole + 2
    turn = 2 * np.pi * phase
    return middle - half * np.cos(turn), speed_of * rate * np.sin(turn)


def creep(truth: Truth, time, profile=pulled):
    """Output force [N] at some times, for the input force and speed that a profile gives."""
    stiffness, damping = truth.stiffness * truth.exponent, truth.damping

    def grows(f, speed, sign):
        """Friction gained for each bit that the load end moves."""
        return stiffness * (1 - sign * f / float(truth.steady(speed)[0]))

    def change(t, state):
        """Without damping: x' = y' + f' and f' = grows y'."""
        (before, force, after), speed = profile(np.array([t - 1e-5, t, t + 1e-5]))[0], profile(np.array([t]))[1]
        pulls = (after - before) / 2e-5 / force
        moves = pulls / (1 + grows(state[1], speed, 1.0 if pulls >= 0 else -1.0))
        return [moves, pulls - moves]

    def change_damped(t, state):
        """With damping: x - y - f is that of the bristles and of the damper."""
        y, f = state
        force, speed = profile(np.array([t]))
        lead = float(np.log(force[0])) - y - f
        gain = grows(f, speed, 1.0 if lead >= 0 else -1.0)
        moves = lead / (LOAD_DAMPER + damping * max(gain, 0.0))
        return [moves, gain * moves]

    x = float(np.log(profile(np.array([time[0]]))[0][0]))
    start = [x - 0.3 * truth.exponent, 0.3 * truth.exponent]
    function, method = (change_damped, "LSODA") if damping else (change, "RK45")
    solved = solve_ivp(function, (time[0], time[-1]), start, method, time, rtol=1e-6, atol=1e-9, max_step=0.04)
    assert solved.success
    return np.exp(solved.y[0])
