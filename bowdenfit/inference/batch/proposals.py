"""What weighted draws are drawn from: Student-t's about the maxima of a posterior, then what is learnt from such draws.

References:
    Cappé, Douc, Guillin, Marin and Robert 2008, "Adaptive importance sampling in general mixture classes" (Statistics and
    Computing 18), for learning from weighted draws.
    Owen and Zhou 2000, "Safe and effective importance sampling" (Journal of the American Statistical Association 95), for the
    draws from the prior, and later from the first proposal, which bound the weights.
"""

from dataclasses import dataclass
from typing import Any, NamedTuple, TypeAlias

import numpy as np

from bowdenfit.inference.batch.mixture import StudentMixture, start_mixture

_PRIOR_SHARE = 0.05  # of the draws about the maxima that the prior has
_MAXIMA_SHARE = 0.1  # of learnt ones that these have
_PARTS, _FRICTION_PARTS = 6, 2
_WIDE, _WIDE_SHARE = 2.5, 0.2  # of one more part: by how much wider than the draws, and its share


class ProposedPoints(NamedTuple):
    """The same points in two coordinates: z, and w, in which friction coefficients follow everything else.

    Args:
        w, z: One point a row; 0 where one has no other.
        log_volume: Log of the volume in z of a unit of w there; infinite where z has no w.
        log_density: Of the posterior in z; minus infinity where there is none.
    """

    w: Any
    z: Any
    log_volume: Any
    log_density: Any


@dataclass(frozen=True)
class MaximaProposal:
    """Student-t's in z, and the prior, a standard normal.

    Args:
        students: About the maxima.
    """

    students: StudentMixture

    def draw(self, generator: np.random.Generator, count: int) -> tuple[np.ndarray, np.ndarray]:
        """So many points, and of each whether it is a z, and a w otherwise."""
        of_prior = round(_PRIOR_SHARE * count)
        prior = generator.standard_normal((of_prior, self.students.center.shape[1]))
        z = np.concatenate([prior, self.students.draw(generator, count - of_prior)])
        return z, np.ones(count, dtype=bool)

    def log_density(self, at: ProposedPoints) -> np.ndarray:
        """In z."""
        prior = -0.5 * (np.einsum("ni,ni->n", at.z, at.z) + at.z.shape[1] * np.log(2 * np.pi))
        return np.logaddexp(self.students.log_density(at.z) + np.log1p(-_PRIOR_SHARE), prior + np.log(_PRIOR_SHARE))


@dataclass(frozen=True)
class LearntProposal:
    """Student-t's in w, of friction coefficients and of everything else apart, and some draws of the first proposal.

    Args:
        first: About the maxima.
        groups: Which parameters are drawn together, and from what.
    """

    first: MaximaProposal
    groups: tuple[tuple[np.ndarray, StudentMixture], ...]

    def draw(self, generator: np.random.Generator, count: int) -> tuple[np.ndarray, np.ndarray]:
        """See `MaximaProposal`."""
        z, is_z = self.first.draw(generator, round(_MAXIMA_SHARE * count))
        w = np.zeros((count - len(z), z.shape[1]))
        for which, students in self.groups:
            w[:, which] = generator.permutation(students.draw(generator, len(w)))  # else the same parts would always meet
        return np.concatenate([z, w]), np.concatenate([is_z, np.zeros(len(w), dtype=bool)])

    def log_density(self, at: ProposedPoints) -> np.ndarray:
        """See `MaximaProposal`."""
        learnt = -at.log_volume
        for which, students in self.groups:
            learnt = learnt + students.log_density(at.w[:, which])
        return np.logaddexp(learnt + np.log1p(-_MAXIMA_SHARE), self.first.log_density(at) + np.log(_MAXIMA_SHARE))


Proposal: TypeAlias = MaximaProposal | LearntProposal


def learn_proposal(previous: Proposal, w: np.ndarray, friction: np.ndarray) -> LearntProposal:
    """A proposal nearer to a posterior.

    Args:
        before: The one before.
        w: Draws of the posterior, about, one a row.
        friction: Which parameters are friction coefficients.
    """
    first = previous.first if isinstance(previous, LearntProposal) else previous
    groups = []
    for which, parts in ((np.flatnonzero(friction), _FRICTION_PARTS), (np.flatnonzero(~friction), _PARTS)):
        if len(which):
            rows = w[:, which]
            groups.append((which, start_mixture(rows, parts).refined(rows).with_wide_component(rows, _WIDE, _WIDE_SHARE)))
    return LearntProposal(first, tuple(groups))
