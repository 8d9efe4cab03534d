"""The verbs that the command line and notebooks share, one line each."""

from bowdenfit.questions.calibrate.verb import VERB as CALIBRATE
from bowdenfit.questions.check.verb import VERB as CHECK
from bowdenfit.questions.compare.verb import VERB as COMPARE
from bowdenfit.questions.compensate.verb import VERB as COMPENSATE
from bowdenfit.questions.export.verb import VERB as EXPORT
from bowdenfit.questions.fleet.verb import VERB as FLEET
from bowdenfit.questions.identify.verb import VERB as IDENTIFY
from bowdenfit.questions.length.verb import VERB as LENGTH
from bowdenfit.questions.metabolic.verb import VERB as METABOLIC
from bowdenfit.questions.next.verb import VERB as NEXT
from bowdenfit.questions.pool.verb import VERB as POOL
from bowdenfit.questions.predict.verb import VERB as PREDICT
from bowdenfit.questions.report.verb import VERB as REPORT
from bowdenfit.questions.schema.verb import VERB as SCHEMA
from bowdenfit.questions.simulate.verb import VERB as SIMULATE
from bowdenfit.questions.summary.verb import PLOT_VERB as PLOT
from bowdenfit.questions.summary.verb import SUMMARY_VERB as SUMMARY
from bowdenfit.questions.teleoperate.verb import VERB as TELEOPERATE
from bowdenfit.questions.watch.verb import VERB as WATCH
from bowdenfit.run.verb import VERB as FIT

VERBS = (
    CHECK, FIT, SUMMARY, PREDICT, LENGTH, IDENTIFY, NEXT, WATCH, COMPARE, COMPENSATE, TELEOPERATE, EXPORT, CALIBRATE, FLEET,
    POOL, PLOT, REPORT, SIMULATE, METABOLIC, SCHEMA,
)  # fmt: skip
