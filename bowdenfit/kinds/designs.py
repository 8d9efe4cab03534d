"""A whole design: what every kind reads of [design], in one."""

from collections.abc import Mapping
from functools import lru_cache
from typing import Any

from pydantic import BaseModel, ValidationError, create_model

from bowdenfit.description import Description
from bowdenfit.description.values import Frozen
from bowdenfit.description.wrong_keys import wrong_keys
from bowdenfit.errors import DescriptionError
from bowdenfit.kinds import KINDS
from bowdenfit.kinds.kind import Design, PlannedKind


def read_design(page: Mapping[str, Any], description: Description, file: str) -> Design:
    """The design of a plan.

    Args:
        page: [design] as read.
        description: The cable.
        file: Its file, for errors.

    Raises:
        DescriptionError: A key or a value is wrong, or this cable cannot have what is asked for.
    """
    design = _parsed(page, file)
    for kind in _planned_kinds():
        if why := kind.design_contradiction(design, description):
            raise DescriptionError(f"{file}, design.{why}")
    return design


def design_of(**measured: Any) -> Design:
    """A design of any cable, from keywords; what a cable does not have of it is not measured."""
    return _parsed(measured, "the design")


def _planned_kinds() -> list[PlannedKind[Any]]:
    return [kind for kind in KINDS.values() if isinstance(kind, PlannedKind)]


def _parsed(page: Mapping[str, Any], file: str) -> Design:
    model = _page(tuple(kind.design for kind in _planned_kinds()))
    raw = {"design": dict(page)}
    try:
        return model.model_validate(raw).design  # type: ignore[attr-defined]
    except ValidationError as error:
        raise wrong_keys(error, raw, model, file, "write it, such as loads = [10, 20, 40]") from None


@lru_cache
def _page(parts: tuple[type[Design], ...]) -> type[BaseModel]:
    """What is read of a plan."""
    whole = create_model("WholeDesign", __base__=parts, __module__=__name__)
    return create_model("DesignPage", __base__=Frozen, __module__=__name__, design=(whole, ...))
