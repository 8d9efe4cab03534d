"""A curve family: a wrap angle that grows with the square of the length."""

from bowdenfit.cable.curves import Curve
from bowdenfit.parameters.priors import HalfNormal


class Square(Curve):
    """End ((1 + z)/2)^2"""

    coefficients = ("end",)
    heading = "Squares"

    def parameters(self, detected, defaults):
        return (self._parameter("end", "e", "wrap angle at the end of the range", HalfNormal(3.0), "rad"),)

    def at(self, z, *coefficients):
        (end,) = coefficients
        return end * ((1 + z) / 2) ** 2
