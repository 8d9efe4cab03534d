"""How laboratories write what a column holds: words in five languages, symbols, and pairs that say it only together."""

import re
import unicodedata
from collections.abc import Iterable
from dataclasses import dataclass

from bowdenfit.units import dimension_of, is_unit, weight_of

_WORDS = {
    "input": "input in inlet eingang ein einlauf entree entrada ingresso entrata motor antrieb actuator actuation actuating "
    "actuated aktor aktuator drive driving driver moteur actionneur actionnement motriz actuador accionamiento motore "
    "attuatore proximal proximale prossimale prox upstream",
    "output": "output out outlet ausgang aus auslauf sortie salida uscita distal distale dist downstream abtrieb effector tip",
    "load": "load last charge carga carico weight gewicht poids peso mass masse masa massa hanging hung suspended "
    "dead",  # at the output, but only beside the other end
    "pull": "pull pulling pulled zug traction tiro tirer effort applied",  # at the input, likewise
    "force": "force forces f kraft zugkraft seilkraft seilspannung fuerza forza t tension tensione spannung",
    "side": "side end seite ende cote extremite bout lado extremo lato estremita",
    "": "the of at on de du d la le l les el del della di al dell der die das des am an auf im sensor sensors cell loadcell "
    "zelle messzelle kraftsensor capteur celula cella cable rope seil tendon wire kabel cavo corde bowden measured reading "
    "readings value wert messwert mesuree medida gemessen mean average mittelwert moyenne media",
}
_ROLES = {word: role for role, words in _WORDS.items() for word in words.split()}
_NAMES = {
    "stroke": "direction|richtung|hub|hubrichtung|bewegungsrichtung|stroke direction|sens|sens de deplacement|sentido|"
    "direccion|carrera|direzione|corsa",
    "velocity": "speed|geschwindigkeit|seilgeschwindigkeit|drehzahl|motordrehzahl|vitesse|velocidad|velocita|cable speed|"
    "rope speed|motor speed|motor velocity|cable velocity",
    "run": "run no|run nr|run number|run id|mounting|mounting no|mounting number|montage|montaje|montaggio|lauf|"
    "lauf nr|laufnummer",
    "wrap_angle": "wrapping angle|angle of wrap|total wrap angle|umschlingungswinkel|umschlingung|angle d enroulement|"
    "angle d embrassement|angulo de abrazamiento|angulo de abrazo|angolo di avvolgimento",
    "efficiency": "wirkungsgrad|ubertragungswirkungsgrad|rendement|rendimiento|eficiencia|rendimento|efficienza|eta|eff|"
    "transmission efficiency|force efficiency|efficiency of transmission|output input|out in|fout fin|f out f in|"
    "output force input force|force ratio|tension ratio",
    "loss": "force loss|friction loss|loss of force|verlust|kraftverlust|reibungsverlust|perte|perte de force|perdida|"
    "perdida de fuerza|perdita|perdita di forza",
}
_QUANTITIES = {name: quantity for quantity, names in _NAMES.items() for name in names.split("|")}
_AMBIGUOUS_NAMES = {  # what only the user can say
    "wrap_angle": "wrap|bend|bend angle|bending angle|total bend angle|contact angle|angle|theta|phi|winkel|biegewinkel|"
    "umlenkwinkel|angle de contact|angulo|angulo de contacto|angulo de curvatura|angolo|nominal angle|nominal wrap|"
    "measured angle|measured wrap|nominal wrap angle|measured wrap angle|deg|degree|degrees|grad|turns|turn|wraps|windings|"
    "umdrehungen|windungen|tours|vueltas|giri|loops|coils",
}
# A heading with one of these words may be that of wrap angles; with one of the second, it is that of something else's angle.
_ANGLE_WORDS = (
    "angle angles deg degree degrees bend bends bending bent curve curvature curved turn turns wrap wraps wrapping theta phi "
    "deflection winkel grad biegung biegewinkel umlenkung umlenkwinkel umschlingung krummung kurve umdrehungen windungen coude "
    "courbure virage angulo curvatura curva giro vueltas angolo piega giri loops coils elbow direction configuration"
)
_OTHER_ANGLE_WORDS = (
    "motor encoder joint crank pulley servo shaft wheel drum position motorwinkel gelenk knee ankle hip flexion phase step "
    "error sd std stdev uncertainty noise radius"
)
_ANGULAR, _OTHER_ANGLES = frozenset(_ANGLE_WORDS.split()), frozenset(_OTHER_ANGLE_WORDS.split())
_BEND_WORDS = (  # of the angular ones those of nothing but a bent cable
    "bend bends bending bent curve curvature curved wrap wraps wrapping biegung biegewinkel umlenkung umlenkwinkel "
    "umschlingung krummung kurve coude courbure virage curvatura curva piega"
)
_BENDS = frozenset(_BEND_WORDS.split())
_WITH_UNIT_ALONE = frozenset({"elbow", "direction", "configuration"})  # else a label, or a direction of motion
_COUNTED = {"turn": "turn", "turns": "turn", "wraps": "turn", "windungen": "turn", "umdrehungen": "turn", "tours": "turn",
            "vueltas": "turn", "giri": "turn", "windings": "turn", "loops": "turn", "coils": "turn",
            "deg": "deg", "degree": "deg", "degrees": "deg"}  # fmt: skip
_GUESSES = {name: quantity for quantity, names in _AMBIGUOUS_NAMES.items() for name in names.split("|")}
_RATIO = ("ratio",)
_MOST_RADIANS = 13.0  # two turns are 12.6; larger numbers are degrees
_DIMENSIONS = {"velocity": ("velocity", "angular_velocity"), "wrap_angle": ("angle",), "efficiency": _RATIO, "loss": _RATIO}
_SYMBOL = re.compile(r"([ft])(in|out|ein|aus|input|output|motor|mot|act|load|prox|dist|ent|sal|i|o)")
_ENDS = {"mot": "motor", "act": "actuator", "ent": "entrada", "sal": "salida", "i": "in", "o": "out"}
_COMPOUND = re.compile(r"(?P<end>\w{3,}?)s?(?P<of>kraft|spannung|seite|seitig)")
_BRACKETED = re.compile(r"[\[(](?P<unit>[^\[\]()]+)[\])]")
_PREPOSITION = re.compile(r"^(?P<name>.*\S)\s+(?:in|en)\s+(?P<unit>\S+)$", re.IGNORECASE)
_SPREAD = re.compile(  # standard deviations alone: an error or an uncertainty may be several of them, or a bound
    r"±|\+/?-|(?<![^\W_])(?:sd|s\.d\.|std|stdev|std\.? ?dev\.?|standard[ _]deviation|standardabweichung|stabw|"
    r"[eé]cart[- ]type|desviaci[oó]n est[aá]ndar|deviazione standard|sigma)(?![^\W_])",
    re.IGNORECASE,
)
_NUMBERED = re.compile(r"[tf]_?(?P<number>[12])|tension ?(?P<of>[12])")
_LENGTH_WORDS = re.compile(r"length|lange|laenge|longueur|longitud|lunghezza")


@dataclass(frozen=True)
class Spelling:
    """What a heading says in other words than the name of its quantity.

    Args:
        quantity: Name of the quantity.
        unit: Unit that stands in the heading; None without one.
        pair: What must say the other end for this to say its own: "number" for the other one of T1 and T2, "load" for
            anything else; "said" where only the user can say so; empty where the heading says it alone.
    """

    quantity: str
    unit: str | None
    pair: str = ""


def parse_heading(heading: str, unit: str = "") -> Spelling | None:
    """Return the quantity that a heading means, if its words are those of one; None where a word is not known.

    Args:
        heading: As written, with or without its unit.
        unit: Unit that the file gives elsewhere, as in a row below the headings.
    """
    if _SPREAD.search(heading):
        of = parse_heading(_SPREAD.sub(" ", heading), unit)
        is_force = of is not None and of.quantity in ("input_force", "output_force") and not of.pair
        return Spelling(f"{of.quantity}_sd", of.unit) if of is not None and is_force else None
    for name, written in _divided(heading, unit):
        plain = " ".join(_words(name))
        if quantity := _QUANTITIES.get(plain) or _GUESSES.get(plain):
            fits = not written or dimension_of(written) in _DIMENSIONS.get(quantity, ())
            return Spelling(quantity, written or None, "" if plain in _QUANTITIES else "said") if fits else None
        numbered = _NUMBERED.fullmatch(_folded(name))
        if numbered:
            end = "input" if "1" in (numbered["number"], numbered["of"]) else "output"
            return Spelling(f"{end}_force", written or None, "number") if _may_be_force(written) else None
        end_and_pair = _end_of(plain.split(), written)
        if end_and_pair and _may_be_force(written):
            return Spelling(f"{end_and_pair[0]}_force", written or None, end_and_pair[1])
    return None


def likely_wrap_angle(heading: str, unit: str = "") -> Spelling | None:
    """Return that a column is likely to hold wrap angles, with the unit that the file gives; None for any other column.

    Args:
        heading: As written, with or without its unit.
        unit: Unit that the file gives elsewhere, as in a row below the headings.
    """
    divided = list(_divided(heading, unit))
    words = set(_words(divided[0][0]))
    written = next((unit for _, unit in divided if unit), "")
    if words & _OTHER_ANGLES or (written and dimension_of(written) != "angle"):
        return None
    if not written and not words & (_ANGULAR - _WITH_UNIT_ALONE):
        return None
    return Spelling("wrap_angle", written or None, "said")


def names_bend(heading: str) -> bool:
    """Return whether a heading says that it is of a bent cable, as an angle alone does not."""
    return bool(_BENDS.intersection(_words(heading)))


def likely_angle_unit(heading: str, high: float, are_whole: bool) -> str:
    """Return the likely unit of angles whose heading has none; empty for what may be a count.

    Args:
        heading: What they are called, which may be the unit itself.
        high: The largest of them.
        are_whole: Whether they are whole numbers.
    """
    unit, are_few = implied_angle_unit(heading), are_whole and high <= _MOST_RADIANS
    if unit and not (unit == "deg" and names_bend(heading) and are_few):  # as in the number of 90 deg bends
        return unit
    return "" if are_few else "deg" if high > _MOST_RADIANS else "rad"


def implied_angle_unit(heading: str) -> str:
    """Return the unit that a heading of angles is itself, as "Turns" and "deg" are; empty for any other."""
    return next((_COUNTED[word] for word in _words(heading) if word in _COUNTED), "")


def _divided(heading: str, unit: str) -> Iterable[tuple[str, str]]:
    """Yield name and unit of a heading, in every way that it may be divided, the likeliest first; units are known ones."""
    bracketed = next((match for match in _BRACKETED.finditer(heading) if is_unit(match["unit"].strip())), None)
    if bracketed:
        yield heading.replace(bracketed[0], " "), bracketed["unit"].strip()
        return
    plain = heading.replace("(", " ").replace(")", " ").replace("[", " ").replace("]", " ")
    preposition = _PREPOSITION.match(plain)
    if preposition and is_unit(preposition["unit"]):  # "Kraft in N" is no force at an input
        yield preposition["name"], preposition["unit"]
        return
    yield plain, unit if unit and is_unit(unit) else ""
    parts = re.split(r"[\s_\-]+", plain.strip())
    if len(parts) > 1 and _known(parts[:-1]) and is_unit(parts[-1]):
        yield " ".join(parts[:-1]), parts[-1]


def _known(parts: list[str]) -> bool:
    """Return whether the words before a unit say a quantity, so that not every last word is looked up among all units."""
    name = " ".join(parts)
    plain = _words(name)
    is_named = " ".join(plain) in _QUANTITIES | _GUESSES
    return is_named or bool(_NUMBERED.fullmatch(_folded(name))) or _end_of(plain, "N") is not None


def _end_of(words: Iterable[str], unit: str) -> tuple[str, str] | None:
    """Return which end of the cable the words of a force name, and what pair they need; None if they name none."""
    roles = {_ROLES.get(word) for word in _split(words)}
    if None in roles or not ("force" in roles or unit):
        return None
    at = roles & {"input", "output"}
    if at:
        return (str(*at), "") if len(at) == 1 else None
    if len(roles & {"load", "pull"}) != 1:
        return None
    if "load" in roles:
        return "output", "" if "side" in roles else "load"
    return "input", "load"


def _may_be_force(unit: str) -> bool:
    return not unit or bool(weight_of(unit)) or dimension_of(unit) == "force"


def names_length(heading: str) -> bool:
    """Return whether a heading says that it is a length, in one of five languages."""
    return bool(_LENGTH_WORDS.search(without_accents(heading).lower()))


def names_force(heading: str) -> bool:
    """Return whether one of the words of a heading means force, in one of five languages: "field.wrench_in.force.z"."""
    return any(_ROLES.get(word) == "force" for word in _split(_words(heading)))


def without_accents(text: str) -> str:
    """Return letters without what stands above or below them."""
    letters = unicodedata.normalize("NFKD", text.replace("ß", "ss"))
    return "".join(letter for letter in letters if not unicodedata.combining(letter))


def _folded(text: str) -> str:
    """Return a text in lower case, without accents, one space or underscore between words."""
    plain = without_accents(text.replace("θ", "theta").replace("η", "eta")).lower()
    return " ".join(re.sub(r"[^\w]+", " ", plain).split())


def _words(name: str) -> list[str]:
    """Return words of a heading: "InputForce" has two, and "Load cell" says no load."""
    apart = re.sub(r"(?<=[a-z])(?=[A-Z][a-z])", " ", name)
    plain = _folded(apart).replace("_", " ").replace("load cell", "cell")
    return re.sub(r"\b([ft]) ([io])\b", r"\1\2", plain).split()


def _split(words: Iterable[str]) -> Iterable[str]:
    """Yield words with symbols such as Fin, and German compounds such as Eingangskraft, taken apart."""
    for word in words:
        symbol, compound = _SYMBOL.fullmatch(word), _COMPOUND.fullmatch(word)
        if symbol:
            yield from (symbol[1], _ENDS.get(symbol[2], symbol[2]))
        elif compound and word not in _ROLES:
            yield from _split([compound["end"]])
            yield {"seitig": "seite"}.get(compound["of"], compound["of"])
        else:
            yield word
