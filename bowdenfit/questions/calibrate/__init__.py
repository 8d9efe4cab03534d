"""Simulation-based calibration: do posterior intervals of a description contain the truth as often as they claim?

Truth is drawn from the prior, tables are simulated with it and fitted; over many of these replications the rank of the truth
among the draws is uniform if prior, likelihood and sampler are what they claim to be. Truths may be stated instead: then
intervals show what a prior costs that is wrong for such a cable. Functions are loaded when first used.

References:
    Talts et al. 2018, "Validating Bayesian inference algorithms with simulation-based calibration" (arXiv:1804.06788).
"""

import lazy_loader as lazy

__getattr__, __dir__, __all__ = lazy.attach_stub(__name__, __file__)
