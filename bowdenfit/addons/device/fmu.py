"""FMU (FMI 2.0, co-simulation): the C header of a fitted cable, compiled, with its sources."""

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
from bowdenfit.questions.export.c import c_header
from bowdenfit.questions.export.tables import LEVELS, TransmissionTables
from bowdenfit.questions.export.text import ascii_text, fill_template, format_comment, make_identifier
from bowdenfit.words import printable

_COMPILERS = ("cc", "gcc", "clang")
_FLAGS = ("-std=c99", "-O2", "-ffp-contract=off", "-shared", "-fPIC", "-fvisibility=hidden")
# By system and machine: folder and ending of the library (FMI 2.0).
_BINARY = {("linux", "x86_64"): ("linux64", ".so"), ("darwin", "x86_64"): ("darwin64", ".dylib")}
_COMPILE_TIMEOUT = 120.0  # s that a compiler may take; a judgement
_ZIP_DATE = (1980, 1, 1, 0, 0, 0)  # the same tables give the same file


@dataclass(frozen=True)
class _Variable:
    """A real variable: its name, whether it is an input, its unit and what it is."""

    name: str
    is_input: bool
    unit: str
    words: str


def build_fmu(tables: TransmissionTables, name: str) -> bytes:
    """Build the FMU.

    Args:
        tables: The tables.
        name: Name of the cable.

    Raises:
        UsageError: There is no C compiler, it fails, or FMI 2.0 has no name for this kind of machine.
    """
    model_name, text = make_identifier(name), c_header(tables)
    guid = "{" + hashlib.sha256(text.encode("ascii")).hexdigest()[:32] + "}"
    source = fill_template(
        "fmu.c", package=__package__, about=format_comment(tables.sentences, " * "), guid=guid,
        first_place=float(tables.points.values[0]).hex(),
    )  # fmt: skip
    folder, ending = _choose_binary_folder()
    parts = {
        "modelDescription.xml": "\n".join(_write_model_description(tables, model_name, guid)).encode("ascii"),
        "sources/fmu.c": source.encode("ascii"),
        "sources/bowden.h": text.encode("ascii"),
        f"binaries/{folder}/{model_name}{ending}": _compile(source, text, find_compiler()),
    }
    packed = io.BytesIO()
    with zipfile.ZipFile(packed, "w", zipfile.ZIP_DEFLATED) as archive:
        for inside, content in parts.items():
            archive.writestr(zipfile.ZipInfo(inside, _ZIP_DATE), content, zipfile.ZIP_DEFLATED)
    return packed.getvalue()


def find_compiler() -> list[str]:
    """Find the C compiler, with its options where CC has some.

    Raises:
        UsageError: There is none.
    """
    stated = shlex.split(os.environ.get("CC", ""))
    for command in [stated] if stated else [[name] for name in _COMPILERS]:
        if path := shutil.which(command[0]):
            return [path, *command[1:]]
    looked = (
        f"CC names {printable(stated[0])}, which does not exist"
        if stated
        else f"none of {', '.join(_COMPILERS)} is installed"
    )
    raise UsageError(
        f"an FMU holds a compiled program, and there is no C compiler here: {looked}. Install one, or name it in CC; or export "
        "the header alone with --to c."
    )


def _choose_binary_folder() -> tuple[str, str]:
    """Return folder and suffix of compiled programs of this machine."""
    kind = (sys.platform, platform.machine().lower())
    if kind not in _BINARY:
        raise UsageError(
            f"FMI 2.0 has no name for compiled programs of {kind[1]} under {kind[0]}; export --to c, or make the "
            "FMU on Linux of x86_64."
        )
    return _BINARY[kind]


def _compile(source: str, text: str, command: list[str]) -> bytes:
    """Compile the shared library.

    Raises:
        UsageError: The compiler fails.
    """
    with tempfile.TemporaryDirectory() as folder:
        directory = Path(folder)
        (directory / "fmu.c").write_text(source, encoding="ascii")
        (directory / "bowden.h").write_text(text, encoding="ascii")
        call = [*command, *_FLAGS, "-o", "made", "fmu.c", "-lm"]
        try:
            completed = subprocess.run(  # noqa: S603
                call, cwd=directory, capture_output=True, text=True, timeout=_COMPILE_TIMEOUT, check=False
            )
        except (OSError, subprocess.TimeoutExpired) as error:
            raise UsageError(f"the C compiler {command[0]} cannot be run: {error}; name another in CC.") from None
        library = directory / "made"
        if completed.returncode or not library.is_file():
            message = next((line for line in completed.stderr.splitlines() if "error" in line), completed.stderr[-200:])
            error_text = (
                f"the C compiler {command[0]} fails: {printable(message.strip())}. Name another in CC or use --to c."
            )
            raise UsageError(error_text)
        return library.read_bytes()


def _list_variables(tables: TransmissionTables) -> list[_Variable]:
    """Return the real variables in the order of their value references."""
    place, speed = tables.points, tables.speed_unit
    return [
        _Variable("input_force", True, "N", "Force at the motor side"),
        _Variable(
            "place", True, place.unit, place.words if place.unit else "not used: friction is the same everywhere"
        ),
        _Variable("speed", True, speed, "Speed of the rope" if speed else "not used: friction does not depend on it"),
        _Variable("wanted_force", True, "N", "Force that is wanted at the load side"),
        _Variable("output_force", False, "N", "Force at the load side through any motion (play operator)"),
        _Variable("output_force_pulling", False, "N", "The same while the cable slides toward the motor"),
        _Variable("output_force_returning", False, "N", "The same while it slides back"),
        _Variable("input_force_pulling", False, "N", "Force at the motor side that gives wanted_force, pulling"),
        _Variable("input_force_returning", False, "N", "The same, returning"),
    ]


def _write_model_description(tables: TransmissionTables, model_name: str, guid: str) -> Iterator[str]:
    """Yield the lines of modelDescription.xml."""
    variables, about = _list_variables(tables), tables.about
    starts = {"place": tables.points.values[0], "speed": tables.reference_speed}
    units = dict.fromkeys(v.unit for v in variables if v.unit)
    yield '<?xml version="1.0" encoding="UTF-8"?>'
    yield (
        f'<fmiModelDescription fmiVersion="2.0" modelName="{model_name}" guid="{guid}" numberOfEventIndicators="0" '
        f'variableNamingConvention="flat" generationTool={_quote(f"bowdenfit {about.version}, seed {about.seed}")}'
    )
    yield f"  description={_quote(' '.join(tables.sentences))}>"
    yield (
        f'  <CoSimulation modelIdentifier="{model_name}" canHandleVariableCommunicationStepSize="true" '
        'canGetAndSetFMUstate="true" canSerializeFMUstate="true">'
    )
    yield '    <SourceFiles><File name="fmu.c"/></SourceFiles>'
    yield "  </CoSimulation>"
    yield "  <UnitDefinitions>" + "".join(f"<Unit name={_quote(name)}/>" for name in units) + "</UnitDefinitions>"
    yield '  <LogCategories><Category name="logStatusError"/></LogCategories>'
    yield '  <DefaultExperiment startTime="0" stepSize="0.001"/>'
    yield "  <ModelVariables>"
    for number, variable in enumerate(variables):
        kind = 'causality="input"' if variable.is_input else 'causality="output" initial="calculated"'
        start = f' start="{float(starts.get(variable.name, 0.0))!r}"' if variable.is_input else ""
        of_unit = f" unit={_quote(variable.unit)}" if variable.unit else ""
        yield (
            f'    <ScalarVariable name="{variable.name}" valueReference="{number}" {kind} variability="continuous" '
            f"description={_quote(variable.words)}><Real{of_unit}{start}/></ScalarVariable>"
        )
    levels = ", ".join(f"{i} {level.name}" for i, level in enumerate(tables.levels[: len(LEVELS)]))
    words = f"How much friction: {levels}" + (", then draws" if len(tables.levels) > len(LEVELS) else "")
    yield (
        f'    <ScalarVariable name="level" valueReference="0" causality="parameter" variability="tunable" description='
        f'{_quote(words)}><Integer min="0" max="{len(tables.levels) - 1}" start="1"/></ScalarVariable>'
    )
    yield (
        '    <ScalarVariable name="flags" valueReference="1" causality="output" variability="discrete" initial="calculated" '
        'description="1 place outside the range, nearest end taken; 2 nothing is left of the force"><Integer/></ScalarVariable>'
    )
    yield "  </ModelVariables>"
    outputs = [i + 1 for i, variable in enumerate(variables) if not variable.is_input] + [len(variables) + 2]
    unknowns = "".join(f'<Unknown index="{i}"/>' for i in outputs)
    yield f"  <ModelStructure><Outputs>{unknowns}</Outputs><InitialUnknowns>{unknowns}</InitialUnknowns></ModelStructure>"
    yield "</fmiModelDescription>\n"


def _quote(text: str) -> str:
    """Quote a text as an attribute of XML."""
    return quoteattr(ascii_text(text))
