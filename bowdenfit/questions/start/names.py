"""Questions for names: a name is refused at once where `check` would refuse it later, in the same words."""

import re
from collections.abc import Callable, Collection

from pydantic import TypeAdapter, ValidationError

from bowdenfit.description import RESERVED_NAMES, Contact, Name
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
"""Names of all parameters that belong neither to a contact, a column nor a run: coefficients may not use them."""
_NUMBERED = re.compile(r"(amplitude|displacement_zero|release|rest)_\d+")  # of a run
_OF_CURVE = ("a", "b", "c", "A", "B", "C", "middle", "slope")  # behind the name of its column
_NAME = TypeAdapter[str](Name)


def ask_cable_name(words: str, default: str | None, why: str = "", example: str = "") -> Question[str]:
    """Ask for the name of a cable."""
    return Question(words, _checked_name, default, why, example)


def ask_contact_name(words: str, default: str | None, taken: Collection[str]) -> Question[str]:
    """Ask for the name of a contact.

    Args:
        words: The question.
        default: What Enter says; not proposed where another contact is called so.
        taken: The names of the other contacts.
    """

    def read(typed: str) -> str:
        name = _checked_name(typed)
        if name in taken:
            raise UsageError(f"{shown(name)} is another place already; write another one.")
        return name

    proposed = None if default in taken else default
    return Question(words, read, proposed, "" if proposed else "two places would have the same name.", "edge")


def ask_coefficient_name(words: str, default: str, columns: Collection[str]) -> Question[str]:
    """Ask for the name of a coefficient of friction.

    Args:
        words: The question.
        default: What Enter says.
        columns: Columns of wrap angles, after which the parameters of their curves are called.
    """

    def read(typed: str) -> str:
        name = _checked_name(typed)
        _refuse_invalid(lambda: Contact.model_validate({"name": "x", "friction": name, "wrap_angle": {"column": "x"}}))
        of_curves = {f"{column}_{ending}" for column in columns for ending in _OF_CURVE}
        if name in PARAMETERS or name in RESERVED_NAMES or name in of_curves or _NUMBERED.fullmatch(name):
            raise UsageError(
                f"{shown(name)} is what results call another number; write another name, such as {default}."
            )
        return name

    return Question(words, read, default)


def _checked_name(typed: str) -> str:
    name = " ".join(typed.split())
    if name in PLACEHOLDERS:
        raise UsageError(f"{shown(name)} is left from the template; write {PLACEHOLDERS[name]}.")
    _refuse_invalid(lambda: _NAME.validate_python(name))
    return name


def _refuse_invalid(validate: Callable[[], object]) -> None:
    """Refuse what a description would refuse."""
    try:
        validate()
    except ValidationError as error:
        raise UsageError(f"{error.errors()[0]['msg'].removeprefix('Value error, ')}.") from None
