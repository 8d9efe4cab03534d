"""The verbs that the command line and notebooks share: of the core, one line each, and of add-ons, by entry points."""

from bowdenfit.extensions import report_problem
from bowdenfit.questions.calibrate.verb import VERB as CALIBRATE
from bowdenfit.questions.check.verb import VERB as CHECK
from bowdenfit.questions.compare.verb import VERB as COMPARE
from bowdenfit.questions.export.verb import VERB as EXPORT
from bowdenfit.questions.identify.verb import VERB as IDENTIFY
from bowdenfit.questions.length.verb import VERB as LENGTH
from bowdenfit.questions.next.verb import VERB as NEXT
from bowdenfit.questions.predict.verb import VERB as PREDICT
from bowdenfit.questions.report.verb import VERB as REPORT
from bowdenfit.questions.schema.verb import VERB as SCHEMA
from bowdenfit.questions.simulate.verb import VERB as SIMULATE
from bowdenfit.questions.summary.verb import PLOT_VERB as PLOT
from bowdenfit.questions.summary.verb import SUMMARY_VERB as SUMMARY
from bowdenfit.questions.watch.verb import VERB as WATCH
from bowdenfit.run.verb import VERB as FIT
from bowdenfit.verb import Verb, load_added_verbs

CORE = (
    CHECK, FIT, SUMMARY, PREDICT, LENGTH, IDENTIFY, NEXT, WATCH, COMPARE, EXPORT, CALIBRATE, PLOT, REPORT, SIMULATE, SCHEMA,
)  # fmt: skip
RESERVED = ("init", "completion", "help", "version")  # by the command line itself


def _collect_added_verbs() -> tuple[Verb, ...]:
    """Verbs that add-ons give by entry points, without those that take a name of the core."""
    taken, added = {*RESERVED, *(verb.command_name for verb in CORE)}, load_added_verbs()
    for name in sorted(taken & {verb.command_name for verb in added}):
        report_problem(f"the verb {name!r} of an add-on is left out, because bowdenfit has one of that name.")
    return tuple(verb for verb in added if verb.command_name not in taken)


VERBS = (*CORE, *_collect_added_verbs())
