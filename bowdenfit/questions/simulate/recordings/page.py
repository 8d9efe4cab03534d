"""[recordings] of a plan as written, and errors in it as sentences."""

import dataclasses
from collections.abc import Mapping
from typing import Annotated, Any, TypeVar

from pydantic import BaseModel, ConfigDict, Field, TypeAdapter, ValidationError

from bowdenfit.description import Finite, QuantityValue
from bowdenfit.errors import DatasetError, DescriptionError, nearest

Settings = TypeVar("Settings")


class Also(BaseModel):
    """[[recordings.also]]: one more recording, and in what it differs from the others."""

    model_config = ConfigDict(extra="forbid", frozen=True)
    length: Finite | None = None
    speed: str | None = None
    run: str | None = None
    profile: dict[str, Any] = {}
    bench: dict[str, Any] = {}
    friction: dict[str, Any] = {}
    faults: dict[str, Any] = {}


class Page(BaseModel):
    """[recordings] as written: one recording for each length at each speed, and then those of `also`."""

    model_config = ConfigDict(extra="forbid", frozen=True)
    lengths: tuple[Finite, ...] = ()
    speeds: Annotated[tuple[str, ...], Field(min_length=1)]
    angles: tuple[Finite, ...] = ()
    measured_angles: tuple[dict[str, Finite], ...] = ()
    decimals: Annotated[int, Field(ge=0, le=9)] = 3
    also: tuple[Also, ...] = ()
    profile: dict[str, Any] = {}
    bench: dict[str, Any] = {}
    friction: dict[str, Any] = {}
    faults: dict[str, Any] = {}


def explained(error: ValidationError, file: str) -> str:
    """The first thing that is wrong, as a sentence."""
    first = next((e for e in error.errors() if e["type"] == "extra_forbidden"), error.errors()[0])
    where = ".".join(["recordings", *map(str, first["loc"])])
    if first["type"] == "extra_forbidden":
        page = Also if first["loc"][0] == "also" else Page
        return f"{file}: unknown key {where!r}{nearest(str(first['loc'][-1]), list(page.model_fields))}"
    if first["type"] == "missing":
        return f'{file}: the key {where!r} is missing; write it, such as speeds = ["20 r/min"].'
    return f"{file}, {where}: {first['msg'][:1].lower()}{first['msg'][1:]} (found {first['input']!r})."


def settings_of(kind: type[Settings], raw: Mapping[str, Any], place: str, **given: Any) -> Settings:
    """One of the four sections as its frozen class."""
    fields = [f.name for f in dataclasses.fields(kind) if f.name not in given]  # type: ignore[arg-type]
    for name in raw:
        if name not in fields:
            raise DescriptionError(f"{place}: unknown key {name!r}{nearest(name, fields)}")
    try:
        return TypeAdapter(kind).validate_python({**raw, **given})
    except ValidationError as error:
        first = error.errors()[0]
        where = ".".join(map(str, first["loc"]))
        message = f"{first['msg'][:1].lower()}{first['msg'][1:]}"
        raise DescriptionError(f"{place}, {where}: {message} (found {first['input']!r}).") from None


def with_reference_force(page: Page, raw: Mapping[str, Any], file: str) -> Page:
    """The page with the description's reference force, where it states one and the page does not."""
    if "reference_force" not in raw or "reference_force" in page.friction:
        return page
    try:
        force = QuantityValue.model_validate(raw["reference_force"]).to("force")
    except (ValidationError, DatasetError):
        raise DescriptionError(
            f'{file}, reference_force: write a force, such as reference_force = {{ value = 50, unit = "N" }}.'
        ) from None
    return page.model_copy(update={"friction": {**page.friction, "reference_force": force}})
