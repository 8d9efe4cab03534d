"""Arrays whose shapes depend on what was read, made longer, so that one compiled program serves many tables."""


def rounded_up(count: int) -> int:
    """The next of few counts: each to eight, then four to every doubling, at most a quarter more than asked for."""
    step = 1 << max(0, (count - 1).bit_length() - 3)
    return -(-count // step) * step
