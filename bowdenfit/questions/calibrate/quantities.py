"""What will be ranked, and whether a data set can be replicated at all."""

from bowdenfit.dataset import Dataset
from bowdenfit.errors import DescriptionError, UsageError
from bowdenfit.kinds import each_table
from bowdenfit.kinds.terms import measured_kinds
from bowdenfit.model import build_model
from bowdenfit.questions.calibrate.answer import QuantityLabel
from bowdenfit.questions.calibrate.workbench import CalibrationPlan
from bowdenfit.results.record import OPTIMAL_EFFICIENCY, OPTIMAL_LENGTH


def list_quantities(plan: CalibrationPlan) -> dict[str, QuantityLabel]:
    """What will be ranked, once it is clear that the data set can be replicated.

    Raises:
        DescriptionError, DatasetError, UsageError: It cannot; says why.
    """
    stated, assumed = plan.stated.description, plan.assumed.description
    for kind, table in measured_kinds(plan.stated.measurements):
        kind.check_drawable(stated, table)
    if stated.angle_columns != assumed.angle_columns or _kinds(plan.stated) != _kinds(plan.assumed):
        raise DescriptionError(
            "--assume changes which tables or columns the data set has; the fits must read what is simulated, so change "
            "only how it is modeled."
        )
    space = build_model(plan.assumed).space
    if not space.size:
        raise UsageError(
            "every parameter of the description is fixed, so there is nothing to calibrate; leave one free."
        )
    quantities = {p.name: QuantityLabel(p.symbol, p.role == "friction", p.meaning) for p in space.free}
    return quantities | {
        OPTIMAL_LENGTH: QuantityLabel(r"$l^*$", meaning="best length"),
        OPTIMAL_EFFICIENCY: QuantityLabel(r"$\eta^*$", meaning="efficiency at the best length"),
    }


def _kinds(dataset: Dataset) -> list[str]:
    return [kind.name for kind, _ in each_table(dataset.measurements)]
