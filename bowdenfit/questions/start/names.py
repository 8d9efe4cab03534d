"""Names that a person writes: each is refused at once where `check` would refuse it later, in the same words."""

import re
from collections.abc import Callable, Collection

from pydantic import TypeAdapter, ValidationError

from bowdenfit.description import TAKEN, Contact, Name
from bowdenfit.description.placeholders import PLACEHOLDERS
from bowdenfit.errors import UsageError
from bowdenfit.questions.start.question import Question
from bowdenfit.words import shown

PARAMETERS = {
    "bedding_load", "bedding_stretch", "delay_error", "drag", "end_spring", "gain_error", "input_offset", "lengthening",
    "load_exponent", "loop_mounting", "mu_stretch", "output_offset", "preload", "ring_friction", "ring_inertia",
    "ring_stiffness", "rope_damping", "rope_give", "rope_stiffness", "sigma_F", "sigma_L", "sigma_P", "sigma_block",
    "sigma_ringdown", "sigma_theta", "sigma_x", "stiffness", "stretch_zero", "stribeck", "stribeck_speed", "stroke_difference",
    "tau", "viscous",
}  # fmt: skip
"""What fits call the parameters that are no coefficients of friction and not of a column or a run."""
_NUMBERED = re.compile(r"(amplitude|displacement_zero|release|rest)_\d+")  # of a run
_OF_CURVE = ("a", "b", "c", "A", "B", "C", "middle", "slope")  # behind the name of its column
_NAME = TypeAdapter[str](Name)


def cable_name(words: str, default: str | None, why: str = "", example: str = "") -> Question[str]:
    """A question after what a cable is called."""
    return Question(words, _nameable, default, why, example)


def place_name(words: str, default: str | None, taken: Collection[str]) -> Question[str]:
    """A question after the name of a contact.

    Args:
        words: The question.
        default: What Enter says; not proposed where another contact is called so.
        taken: The names of the other contacts.
    """

    def read(typed: str) -> str:
        said = _nameable(typed)
        if said in taken:
            raise UsageError(f"{shown(said)} is another place already; write another one.")
        return said

    proposed = None if default in taken else default
    return Question(words, read, proposed, "" if proposed else "two places would have the same name.", "edge")


def coefficient_name(words: str, default: str, columns: Collection[str]) -> Question[str]:
    """A question after the name of a coefficient of friction.

    Args:
        words: The question.
        default: What Enter says.
        columns: Columns of wrap angles, after which the parameters of their curves are called.
    """

    def read(typed: str) -> str:
        said = _nameable(typed)
        _as_described(lambda: Contact.model_validate({"name": "x", "friction": said, "wrap_angle": {"column": "x"}}))
        of_curves = {f"{column}_{ending}" for column in columns for ending in _OF_CURVE}
        if said in PARAMETERS or said in TAKEN or said in of_curves or _NUMBERED.fullmatch(said):
            raise UsageError(f"{shown(said)} is what results call another number; write another name, such as {default}.")
        return said

    return Question(words, read, default)


def _nameable(typed: str) -> str:
    said = " ".join(typed.split())
    if said in PLACEHOLDERS:
        raise UsageError(f"{shown(said)} is left from the template; write {PLACEHOLDERS[said]}.")
    _as_described(lambda: _NAME.validate_python(said))
    return said


def _as_described(validate: Callable[[], object]) -> None:
    """Refuse what a description would refuse."""
    try:
        validate()
    except ValidationError as error:
        raise UsageError(f"{error.errors()[0]['msg'].removeprefix('Value error, ')}.") from None
