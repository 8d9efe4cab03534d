"""Words of a certificate that its page and its XML share."""

import math

from bowdenfit.addons.certificate.answer import CertifiedQuantity
from bowdenfit.addons.certificate.conformity import ConformityStatement
from bowdenfit.words import significant


def describe_limits(statement: ConformityStatement, quantity: CertifiedQuantity) -> str:
    """Return the limits of a quantity, such as 'at most 0.12'."""
    lower, upper = statement.tolerance.lower, statement.tolerance.upper
    unit = f" {quantity.unit}".removesuffix(" 1")
    if math.isfinite(lower) and math.isfinite(upper):
        return f"{lower:g} to {upper:g}{unit}"
    return f"at least {lower:g}{unit}" if math.isfinite(lower) else f"at most {upper:g}{unit}"


def describe_rule(statement: ConformityStatement, quantity: CertifiedQuantity) -> str:
    """Return the decision rule, with its guard band."""
    if not statement.guard_band:
        return "Simple acceptance: the measured value lies within the limits (no guard band)"
    times = statement.guard_band / quantity.expanded
    multiple = "the expanded uncertainty" if abs(times - 1) < 1e-9 else f"{times:g} times the expanded uncertainty"
    return (
        "Guarded acceptance: the measured value lies within the limits by a guard band of "
        f"{quantity.in_unit(statement.guard_band)}, {multiple}; within the guard band of either side, a decision is "
        "conditional"
    )


def describe_risks(statement: ConformityStatement) -> str:
    """Return the risks of a decision in sentences: those of this item, and those over a production if it is stated."""
    conforms, consumer, producer = map(
        describe_probability, (statement.probability, statement.consumer_risk, statement.producer_risk)
    )
    specific = (
        f"This item conforms with a probability of {conforms}: the specific risk of the consumer, if it is accepted, is "
        f"{consumer}, that of the producer, if it is rejected, {producer}."
    )
    if statement.global_risks is None:
        return f"{specific} Global risks are not stated, because no distribution of the production is stated."
    consumer, producer = map(describe_probability, statement.global_risks)
    return (
        f"{specific} Over the stated production, a cable that does not conform is accepted with a probability of "
        f"{consumer} (global risk of the consumer), and one that conforms is not accepted with {producer} (global risk "
        "of the producer)."
    )


def describe_probability(probability: float) -> str:
    """Return a probability in percent to two significant digits, without certainty that draws cannot give."""
    if probability < 0.0005:
        return "less than 0.05 %"
    if probability > 0.9995:
        return "more than 99.95 %"
    return f"{significant(100 * probability, 2 if probability < 0.99 else 3)} %"


def describe_degrees(degrees: float) -> str:
    """Return degrees of freedom to one decimal; those of a thousand or more are as good as infinite."""
    return f"{degrees:.1f}" if degrees < 1000 else "infinite"
