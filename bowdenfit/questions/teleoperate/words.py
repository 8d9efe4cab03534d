"""What `bowdenfit teleoperate` prints: what is felt in the open and of a wall, and which walls are touched without bouncing."""

from collections.abc import Iterator

from bowdenfit.display import text_of
from bowdenfit.questions.teleoperate.answer import Scheme, Teleoperation
from bowdenfit.words import filled, percent, significant, table


@text_of.register(Teleoperation)
def teleoperation_text(found: Teleoperation) -> str:
    """The answer for people, the answer first, in at most 25 lines."""
    lines = "\n".join(filled(line) for line in sentences(found))
    return f"{lines}\n\n{_table(found)}\n"


def sentences(found: Teleoperation) -> list[str]:
    """What is felt, whether the wall is stable, and what other couplings would do."""
    return [
        sentence for sentence in (*_walls(found), *_felt(found), *_diverging(found), *_through_time(found)) if sentence
    ]


def _range(found: Teleoperation) -> str:
    low, high = (f"{angle:.4g}" for angle in found.bends)
    return f"bent to {low} deg" if low == high else f"bent from {low} to {high} deg"


def _walls(found: Teleoperation) -> Iterator[str]:
    hardest, sure = found.stated.hardest, percent(found.probability, 0)
    at = f"one of {found.wall:.4g} N*m/rad with {percent(found.at_wall, 0)}"
    if hardest is None:
        yield (
            f"Through this cable a hand feels walls of up to {found.walls[-1]:.0f} N*m/rad, the hardest looked at, without "
            f"bouncing with at least {sure} probability, {_range(found)}; {at}."
        )
    elif hardest <= 0:
        yield f"Through this cable a hand feels no wall without bouncing with {sure} probability, {_range(found)}; {at}."
    else:
        yield (
            f"Through this cable a hand feels walls of up to {significant(hardest)} N*m/rad without bouncing with at least "
            f"{sure} probability, {_range(found)}; {at}."
        )


def _felt(found: Teleoperation) -> Iterator[str]:
    stated = found.stated
    free = f"{stated.free.median:.3f} N*m in slow free motion (90 % interval {stated.free.q05:.3f} to {stated.free.q95:.3f})"
    if stated.stiffness is None:
        yield f"The hand feels {free}."
        return
    stiffness = stated.stiffness
    yield (
        f"The hand feels {free}, and of the wall {significant(stiffness.median)} N*m/rad "
        f"({significant(stiffness.q05)} to {significant(stiffness.q95)}) while both sides of the loop are taut. "
        "Walls are judged as if there were no dry friction, which only calms."
    )


def _diverging(found: Teleoperation) -> Iterator[str]:
    """Couplings that oscillate without any wall."""
    for scheme in found.schemes:
        if scheme.in_the_open < found.probability:
            yield (
                f"Caution, {scheme.name}: it oscillates in free motion already, with {percent(1 - scheme.in_the_open, 0)} "
                f"probability; from one sample to the next oscillations grow {scheme.radius:.4g} times (median), and at most "
                "1 is stable. Lower the stiffnesses of the coupling, or sample faster."
            )


def _through_time(found: Teleoperation) -> Iterator[str]:
    seen = found.contact
    if seen.bounces is None:
        yield "Simulated with median numbers the slave never reaches the wall: friction holds it."
    else:
        does = "still bounces" if seen.bounces else "does not bounce"
        yield f"Simulated with median numbers it {does} 1.2 s after it touched a wall of {seen.wall_stiffness:.4g} N*m/rad."


def _table(found: Teleoperation) -> str:
    rows = [
        [scheme.name, f"{scheme.free.median:.3f}", _stiffness(scheme), _hardest(found, scheme)]
        for scheme in found.schemes
    ]
    return table(["coupling", "free (N*m)", "wall felt (N*m/rad)", "hardest wall (N*m/rad)"], rows)


def _stiffness(scheme: Scheme) -> str:
    return "-" if scheme.stiffness is None else significant(scheme.stiffness.median)


def _hardest(found: Teleoperation, scheme: Scheme) -> str:
    return (
        f"over {found.walls[-1]:.0f}"
        if scheme.hardest is None
        else "none"
        if scheme.hardest <= 0
        else significant(scheme.hardest)
    )
