"""A functional mock-up unit (FMI 2.0, co-simulation): the C header, compiled, with what describes it."""

import hashlib
import io
import os
import platform
import shlex
import shutil
import subprocess
import sys
import tempfile
import zipfile
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from xml.sax.saxutils import quoteattr

from bowdenfit.errors import UsageError
from bowdenfit.questions.export.c import header
from bowdenfit.questions.export.transmission import LEVELS, Transmission
from bowdenfit.questions.export.words import comment, filled_template, identifier, plain
from bowdenfit.words import printable

_COMPILERS = ("cc", "gcc", "clang")
_FLAGS = ("-std=c99", "-O2", "-ffp-contract=off", "-shared", "-fPIC", "-fvisibility=hidden")
_BINARY = {("linux", "x86_64"): ("linux64", ".so"), ("darwin", "x86_64"): ("darwin64", ".dylib")}  # by system and machine
_LONGEST = 120.0  # s that a compiler may take
_BEGINNING = (1980, 1, 1, 0, 0, 0)  # the same tables give the same file


@dataclass(frozen=True)
class _Variable:
    """A real variable: its name, whether it is an input, its unit and what it is."""

    name: str
    is_input: bool
    unit: str
    words: str


def unit(found: Transmission, name: str) -> bytes:
    """The file.

    Args:
        found: The tables.
        name: Of the cable.

    Raises:
        UsageError: There is no C compiler, it fails, or FMI 2.0 has no name for this kind of machine.
    """
    called, text = identifier(name), header(found)
    guid = "{" + hashlib.sha256(text.encode("ascii")).hexdigest()[:32] + "}"
    source = filled_template(
        "fmu.c", about=comment(found.sentences, " * "), guid=guid, first_place=float(found.places.at[0]).hex()
    )
    folder, ending = _machine()
    parts = {
        "modelDescription.xml": "\n".join(_description(found, called, guid)).encode("ascii"),
        "sources/fmu.c": source.encode("ascii"),
        "sources/bowden.h": text.encode("ascii"),
        f"binaries/{folder}/{called}{ending}": _compiled(source, text, compiler()),
    }
    packed = io.BytesIO()
    with zipfile.ZipFile(packed, "w", zipfile.ZIP_DEFLATED) as archive:
        for inside, content in parts.items():
            archive.writestr(zipfile.ZipInfo(inside, _BEGINNING), content, zipfile.ZIP_DEFLATED)
    return packed.getvalue()


def compiler() -> list[str]:
    """The C compiler, with its options where CC has some.

    Raises:
        UsageError: There is none.
    """
    stated = shlex.split(os.environ.get("CC", ""))
    for command in [stated] if stated else [[name] for name in _COMPILERS]:
        if found := shutil.which(command[0]):
            return [found, *command[1:]]
    looked = f"CC names {printable(stated[0])}, which is not there" if stated else f"none of {', '.join(_COMPILERS)} is there"
    raise UsageError(
        f"an FMU holds a compiled program, and there is no C compiler here: {looked}. Install one, or name it in CC; or export "
        "the header alone with --to c."
    )


def _machine() -> tuple[str, str]:
    """Folder and ending of a compiled program of this machine."""
    kind = (sys.platform, platform.machine().lower())
    if kind not in _BINARY:
        raise UsageError(
            f"FMI 2.0 has no name for compiled programs of {kind[1]} under {kind[0]}; export --to c, or make the "
            "FMU on Linux of x86_64."
        )
    return _BINARY[kind]


def _compiled(source: str, text: str, command: list[str]) -> bytes:
    """The shared library.

    Raises:
        UsageError: The compiler fails.
    """
    with tempfile.TemporaryDirectory() as folder:
        place = Path(folder)
        (place / "fmu.c").write_text(source, encoding="ascii")
        (place / "bowden.h").write_text(text, encoding="ascii")
        call = [*command, *_FLAGS, "-o", "made", "fmu.c", "-lm"]
        try:
            done = subprocess.run(call, cwd=place, capture_output=True, text=True, timeout=_LONGEST, check=False)  # noqa: S603
        except (OSError, subprocess.TimeoutExpired) as error:
            raise UsageError(f"the C compiler {command[0]} cannot be run: {error}; name another in CC.") from None
        made = place / "made"
        if done.returncode or not made.is_file():
            said = next((line for line in done.stderr.splitlines() if "error" in line), done.stderr[-200:])
            words = f"the C compiler {command[0]} fails: {printable(said.strip())}. Name another in CC or use --to c."
            raise UsageError(words)
        return made.read_bytes()


def _variables(found: Transmission) -> list[_Variable]:
    """In the order of their value references."""
    place, speed = found.places, found.speed_unit
    return [
        _Variable("input_force", True, "N", "Force at the motor side"),
        _Variable("place", True, place.unit, place.words if place.unit else "not used: friction is the same everywhere"),
        _Variable("speed", True, speed, "Speed of the rope" if speed else "not used: friction does not depend on it"),
        _Variable("wanted_force", True, "N", "Force that is wanted at the load side"),
        _Variable("output_force", False, "N", "Force at the load side through any motion (play operator)"),
        _Variable("output_force_pulling", False, "N", "The same while the cable slides toward the motor"),
        _Variable("output_force_returning", False, "N", "The same while it slides back"),
        _Variable("input_force_pulling", False, "N", "Force at the motor side that gives wanted_force, pulling"),
        _Variable("input_force_returning", False, "N", "The same, returning"),
    ]


def _description(found: Transmission, called: str, guid: str) -> Iterator[str]:
    """Lines of modelDescription.xml."""
    variables, about = _variables(found), found.about
    starts = {"place": found.places.at[0], "speed": found.reference_speed}
    units = dict.fromkeys(v.unit for v in variables if v.unit)
    yield '<?xml version="1.0" encoding="UTF-8"?>'
    yield (
        f'<fmiModelDescription fmiVersion="2.0" modelName="{called}" guid="{guid}" numberOfEventIndicators="0" '
        f'variableNamingConvention="flat" generationTool={_quoted(f"bowdenfit {about.version}, seed {about.seed}")}'
    )
    yield f"  description={_quoted(' '.join(found.sentences))}>"
    yield (
        f'  <CoSimulation modelIdentifier="{called}" canHandleVariableCommunicationStepSize="true" canGetAndSetFMUstate="true" '
        'canSerializeFMUstate="true">'
    )
    yield '    <SourceFiles><File name="fmu.c"/></SourceFiles>'
    yield "  </CoSimulation>"
    yield "  <UnitDefinitions>" + "".join(f"<Unit name={_quoted(name)}/>" for name in units) + "</UnitDefinitions>"
    yield '  <LogCategories><Category name="logStatusError"/></LogCategories>'
    yield '  <DefaultExperiment startTime="0" stepSize="0.001"/>'
    yield "  <ModelVariables>"
    for number, one in enumerate(variables):
        kind = 'causality="input"' if one.is_input else 'causality="output" initial="calculated"'
        start = f' start="{float(starts.get(one.name, 0.0))!r}"' if one.is_input else ""
        of_unit = f" unit={_quoted(one.unit)}" if one.unit else ""
        yield (
            f'    <ScalarVariable name="{one.name}" valueReference="{number}" {kind} variability="continuous" '
            f"description={_quoted(one.words)}><Real{of_unit}{start}/></ScalarVariable>"
        )
    levels = ", ".join(f"{i} {level.name}" for i, level in enumerate(found.levels[: len(LEVELS)]))
    words = f"How much friction: {levels}" + (", then draws" if len(found.levels) > len(LEVELS) else "")
    yield (
        f'    <ScalarVariable name="level" valueReference="0" causality="parameter" variability="tunable" description='
        f'{_quoted(words)}><Integer min="0" max="{len(found.levels) - 1}" start="1"/></ScalarVariable>'
    )
    yield (
        '    <ScalarVariable name="flags" valueReference="1" causality="output" variability="discrete" initial="calculated" '
        'description="1 place outside the range, nearest end taken; 2 nothing is left of the force"><Integer/></ScalarVariable>'
    )
    yield "  </ModelVariables>"
    outputs = [i + 1 for i, one in enumerate(variables) if not one.is_input] + [len(variables) + 2]
    for_each = "".join(f'<Unknown index="{i}"/>' for i in outputs)
    yield f"  <ModelStructure><Outputs>{for_each}</Outputs><InitialUnknowns>{for_each}</InitialUnknowns></ModelStructure>"
    yield "</fmiModelDescription>\n"


def _quoted(text: str) -> str:
    """A text as an attribute of XML."""
    return quoteattr(plain(text))
