"""Stages of work that takes long, announced by Python's logging: a terminal or notebook shows the last, `--verbose` all.

A program sees them with `logging.basicConfig(level=logging.INFO)`.
"""

import logging

LOGGER = logging.getLogger("bowdenfit")


def announce_stage(words: str) -> None:
    """Announce what is done from now on.

    Args:
        words: Such as "drawing efficiency".
    """
    LOGGER.info(words)
