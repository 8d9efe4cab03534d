"""What the figures of stretch, preload and loops show, as plain arrays; loads no JAX, and must not.

Quantiles have the 5 %, 50 % and 95 % quantiles of the draws as first axis; one row, the least-squares line, without draws.
"""

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class StretchCurve:
    """Stretch at one wrap angle against the load.

    Args:
        wrap_angle: Total wrap angle [deg].
        load: Loads of the curves [N].
        loading: Quantiles of the stretch while the load grows [mm].
        unloading: Quantiles while it comes down from the largest load [mm]; None if no row was read so.
        points_load, points_stretch: Readings [N, mm].
        points_unloading: Whether each was read while the load came down.
    """

    wrap_angle: float
    load: np.ndarray
    loading: np.ndarray
    unloading: np.ndarray | None
    points_load: np.ndarray
    points_stretch: np.ndarray
    points_unloading: np.ndarray


@dataclass(frozen=True)
class PreloadCurve:
    """Preload against the wrap angle between fixed ends.

    Args:
        wrap_angle: Of the curves [deg].
        preload: Quantiles of the preload [N].
        slack: Quantiles of the slack [mm].
        slack_probability: Share of the draws that are slack.
        points_wrap_angle, points_preload: Readings [deg, N].
    """

    wrap_angle: np.ndarray
    preload: np.ndarray
    slack: np.ndarray
    slack_probability: np.ndarray
    points_wrap_angle: np.ndarray
    points_preload: np.ndarray


@dataclass(frozen=True)
class EfficiencyLine:
    """Efficiency [1] against the wrap angle under stated conditions, and by the capstan equation alone.

    Args:
        label: The conditions in words, such as "preload 20 N".
        efficiency: Of the cable.
        capstan: Of the capstan equation with the same coefficient.
    """

    label: str
    efficiency: np.ndarray
    capstan: np.ndarray


@dataclass(frozen=True)
class BendingLoss:
    """Efficiency against the wrap angle.

    Args:
        wrap_angle: Of the lines [deg].
        input_force: Force at which efficiency is meant [N].
        fitted: Quantiles of the cable as fitted, with its own preload [1].
        fitted_capstan: Median of the capstan equation with the fitted coefficients [1].
        fitted_label: Words for it, such as "as fitted, preload 22 N".
        coefficients: Lines for several friction coefficients, with the fitted preload.
        preloads: Lines for several preloads, with the fitted coefficients.
    """

    wrap_angle: np.ndarray
    input_force: float
    fitted: np.ndarray
    fitted_capstan: np.ndarray
    fitted_label: str
    coefficients: tuple[EfficiencyLine, ...]
    preloads: tuple[EfficiencyLine, ...]


@dataclass(frozen=True)
class LoopCurve:
    """Output against input force of a loop at one wrap angle.

    Args:
        label: Wrap angle in words, such as "180 deg".
        input_force: Of the curves [N].
        forward, back: Quantiles of the output force while moving forward and back [N].
        capstan: Median output force of a rope without preload, moving forward [N].
        slack_load: Quantiles of the input force at which the return side goes slack [N].
        points_input, points_output: Readings [N].
        points_stroke: +1 forward, -1 back, 0 of a recording.
    """

    label: str
    input_force: np.ndarray
    forward: np.ndarray
    back: np.ndarray
    capstan: np.ndarray
    slack_load: np.ndarray
    points_input: np.ndarray
    points_output: np.ndarray
    points_stroke: np.ndarray


@dataclass(frozen=True)
class PreloadWindow:
    """What a preload costs and what it buys.

    Args:
        preload: At the reference wrap angle [N].
        reference: That wrap angle in words, such as "at 0 deg"; empty where preload is the same at all.
        friction: Quantiles of what is felt in free motion at the bend where it is largest, in `friction_unit`.
        friction_unit: "N*mm" with a pulley radius, else "N".
        taut_probability: Share of the draws in which both sides stay taut over all bends.
        lowest: 5 %, 50 % and 95 % quantiles of the lowest preload that keeps both sides taut [N].
        bends: Range of wrap angles [deg].
        input_force: Largest input force against which the return side must stay taut [N].
    """

    preload: np.ndarray
    reference: str
    friction: np.ndarray
    friction_unit: str
    taut_probability: np.ndarray
    lowest: np.ndarray
    bends: tuple[float, float]
    input_force: float


@dataclass(frozen=True)
class ElasticFigures:
    """Everything the figures of stretch, preload and loops show; what a cable does not have is empty or None."""

    stretch: tuple[StretchCurve, ...] = ()
    preload: PreloadCurve | None = None
    bending_loss: BendingLoss | None = None
    loops: tuple[LoopCurve, ...] = ()
    window: PreloadWindow | None = None
