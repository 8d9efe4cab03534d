"""How much friction may be fed forward: above it the device moves by itself, whatever holds it as a damper."""

import numpy as np

Number = float | np.ndarray


def moves_by_itself(feed_forward: Number, friction: Number, damping: Number, dead_zone: Number) -> np.ndarray:
    r"""Whether feeding forward keeps the device going: :math:`F_\text{cst} > T_f + F_m + b\,\delta v`.

    Args:
        fed_forward: F_cst [N m].
        friction: T_f + F_m, dry friction of loop and motor [N m].
        damping: b_m + b_j, with the hand's where it is on [N m s/rad].
        dead_zone: dv [rad/s].
    """
    return np.asarray(feed_forward > friction + damping * dead_zone)


def largest_safe_share(margin: np.ndarray, nominal: np.ndarray, risk: float) -> float:
    """Largest c with P(at any bend: c F > T_f + F_m + b dv) of at most a risk.

    Args:
        margin: T_f + F_m + b dv, draws by bends [N m].
        nominal: F that is fed forward at each bend, before the share [N m].
        risk: Such as 0.05.
    """
    return float(np.quantile(np.min(safe_shares(margin, nominal), axis=1), risk, method="lower"))


def safe_shares(margin: np.ndarray, nominal: np.ndarray) -> np.ndarray:
    """Share of F that each draw bears at each bend; infinite where nothing is fed forward."""
    return np.where(nominal > 0, margin / np.maximum(nominal, 1e-300), np.inf)
