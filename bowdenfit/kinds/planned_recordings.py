"""A cable whose recordings are yet to be made: what is known of it without them."""

from collections.abc import Mapping, Sequence
from typing import Any

from bowdenfit.description import Description
from bowdenfit.errors import DescriptionError
from bowdenfit.kinds.designs import design_of
from bowdenfit.kinds.kind import Design
from bowdenfit.kinds.settings import parse_description

_FITTED_FRICTION = ("friction_model", "reference_force", "reference_velocity")


def description_without_recordings(raw: Mapping[str, Any], file: str) -> Description:
    """The cable of a plan without what needs its recordings, whose files do not exist yet: a table of efficiencies stands in
    for them, and [recordings.friction] for a model of friction.

    Args:
        raw: The plan.
        file: Its file, for errors.

    Raises:
        DescriptionError: A table or key is wrong, or cannot be made beside recordings.
    """
    tables = raw.get("tables", {})
    if "recording" in raw:
        raise DescriptionError(f"{file}: a plan has no [[recording]]; these are made from [recordings].")
    for name in tables:
        if name not in {"angles", "recordings"}:
            raise DescriptionError(
                f"{file}, tables.{name}: a plan of recordings makes angles and recordings only; leave it out, or plan it "
                "with [design] in a file of its own."
            )
    kept = {k: v for k, v in raw.items() if k not in {"truth", "recordings", "tables", *_FITTED_FRICTION}}
    angles = {"angles": tables["angles"]} if "angles" in tables else {}
    description = parse_description({**kept, "tables": {**angles, "efficiencies": {"file": "none.csv"}}}, file)
    for contact in description.contact:
        if contact.wrap_angle.constant is None and contact.wrap_angle.curve is None:
            raise DescriptionError(
                f"{file}, contact {contact.name!r}: recordings are simulated from a constant wrap angle or a curve; "
                "this contact has only a column."
            )
    return description


def design_without_recordings(description: Description, angles: Sequence[float]) -> Design:
    """What is measured beside them, at those route values; the table that stands in is read where all curves hold."""
    return design_of(angles=angles, efficiencies=(description.route.middle if description.route else 0.0,))
