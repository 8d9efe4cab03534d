"""Which simulated tables could come from a bench: those that the reader takes and that look like the measured ones.

Priors are weak, so that some of what they allow is no cable: an efficiency of 1 %, an output force below its own noise, a
rope slack at every angle. No bench would hand in such tables, and where noise is as large as what is read the likelihoods,
which take errors to be small, do not hold. They are drawn again, truth and tables together. The rule looks at the simulated
readings alone, never at the truth; and because the posterior is that of the truth given the readings, leaving readings out by
such a rule leaves ranks exactly uniform if they were so.

The limits are wide and are the same for every replication: efficiencies between 20 and 99 %, of every run and recording too;
at least as many detected angles of a contact as its curve has parameters; the largest stretch, preload and scatter within a
factor of ten of the measured one, however it is fitted; and everything that a reader of tables checks.
"""

from bowdenfit.dataset import Dataset
from bowdenfit.kinds import each_table


def why_implausible(measured: Dataset, simulated: Dataset) -> str:
    """Why no bench would hand in the drawn tables, in a few words; empty if one might.

    Args:
        measured: What was measured.
        simulated: What was simulated in its place.
    """
    reasons = (
        kind.why_implausible(measured.measurements.table(kind.table), table)
        for kind, table in each_table(simulated.measurements)
    )
    return next((reason for reason in reasons if reason), "")
