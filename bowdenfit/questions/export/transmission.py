"""A fitted cable as tables: friction by place and level, from which every format is written.

A level is how much friction there is: little (5 %), median, much (95 %), the same of any one mounting, or that of one draw.
"""

from dataclasses import dataclass, field

import numpy as np

QUANTILES = {"q05": 0.05, "q50": 0.5, "q95": 0.95}
MOUNTING = "mounting_"
LEVELS = (*QUANTILES, f"{MOUNTING}q05", f"{MOUNTING}q95")
DRAW = "draw_"


@dataclass(frozen=True)
class FitLabel:
    """Which fit a file was written from.

    Args:
        cable: Name of the cable.
        seed: Of the fit.
        version: Of bowdenfit.
        created: When it was fitted, UTC.
        measured: What it was measured at, in words.
        group: Group of readings that it is for; empty without groups.
        distrust: Why the fit is not to be trusted; empty where it is.
    """

    cable: str
    seed: int
    version: str
    created: str
    measured: tuple[str, ...]
    group: str = ""
    distrust: str = ""


@dataclass(frozen=True)
class TablePoints:
    """Where friction is tabled.

    Args:
        variable: What is varied: the route variable, or "wrap_angle"; "place" where nothing is.
        unit: Its unit; empty where nothing is varied.
        at: Values from the smallest to the largest; one where nothing is varied.
    """

    variable: str
    unit: str
    values: np.ndarray

    @property
    def words(self) -> str:
        """'cable_length 430 to 530 mm'"""
        ends = f"{self.values[0]:.6g} to {self.values[-1]:.6g}" if len(self.values) > 1 else f"{self.values[0]:.6g}"
        return f"{self.variable} {ends} {self.unit}" if self.unit else "one place: nothing is varied"


@dataclass(frozen=True)
class FrictionLevel:
    """Friction of one level.

    Args:
        name: One of `LEVELS`, or of a draw.
        exponent: Friction exponent while pulling and while returning (rows) by place [1].
        taut_loss: What a loop loses while both sides are taut, 2 P Lambda, by place [N]; 0 of a single rope.
        load_exponent: p of the scale g, see `bowdenfit.physics.friction.force_scale` [1].
        drag: D of that scale [N].
        rate: Stribeck rise [1], Stribeck speed and viscous coefficient, see `bowdenfit.physics.friction.rate_factor`.
        stiffness: Of a taut loop, or of a rope under the reference force, seen at the load side with the motor held, by place
            [N/mm]; empty where nothing tells it.
    """

    name: str
    exponent: np.ndarray
    taut_loss: np.ndarray
    load_exponent: float = 0.0
    drag: float = 0.0
    rate: tuple[float, float, float] = (0.0, 1.0, 0.0)
    stiffness: np.ndarray = field(default_factory=lambda: np.zeros(0))


@dataclass(frozen=True)
class TransmissionTables:
    """A fitted cable as tables.

    Args:
        about: Which fit.
        places: Where friction is tabled; between them it is on straight lines.
        levels: Quantiles, then draws.
        is_loop: Whether it is a pull-pull loop.
        options: Of the friction model.
        reference_force: At which the coefficients hold, and the quantiles where friction depends on the load [N].
        reference_speed: At which the coefficients hold, in `speed_unit`.
        speed_unit: "mm/s" or "rad/s"; empty where friction does not depend on speed.
        between: Largest error of the median exponent between two places [1].
        radii: Of the pulleys at the motor and at the load side [mm]; 0 where none is stated.
    """

    about: FitLabel
    points: TablePoints
    levels: tuple[FrictionLevel, ...]
    is_loop: bool
    options: tuple[str, ...]
    reference_force: float
    reference_speed: float
    speed_unit: str
    interpolation_error: float
    radii: tuple[float, float] = (0.0, 0.0)

    @property
    def median(self) -> FrictionLevel:
        """The median level."""
        return self.levels[LEVELS.index("q50")]

    @property
    def depends_on_load(self) -> bool:
        """Whether the share of the force that arrives depends on the load, other than in a loop."""
        return any(level.load_exponent or level.drag for level in self.levels)

    @property
    def depends_on_rate(self) -> bool:
        """Whether friction depends on speed."""
        return bool(self.speed_unit)

    @property
    def sentences(self) -> list[str]:
        """What every file says at its top."""
        about, n = self.about, len(self.levels) - len(LEVELS)
        kind = "pull-pull loop" if self.is_loop else "single rope"
        sentences = [
            f"Cable: {about.cable} ({kind})." + (f" Group: {about.group}." if about.group else ""),
            f"Fitted by bowdenfit {about.version}, seed {about.seed}, {about.created or 'date unknown'}.",
            f"Range: {self.points.words}. Outside it the nearest end counts, and a flag tells.",
            *(f"Measured: {words}." for words in about.measured),
            f"Levels: {', '.join(LEVELS)} of friction" + (f", and {n} draws." if n else "."),
        ]
        if len(self.points.values) > 1:
            sentences.append(
                f"Straight lines between the places miss the median exponent by at most {self.interpolation_error:.1e}."
            )
        if self.depends_on_load:
            sentences.append(
                f"Quantiles hold at an input force of {self.reference_force:g} N, as friction depends on the load."
            )
        if self.depends_on_rate:
            sentences.append(f"Quantiles hold at a speed of {self.reference_speed:g} {self.speed_unit}.")
        return [*sentences, *([f"Warning: this fit is {about.distrust}."] if about.distrust else [])]
