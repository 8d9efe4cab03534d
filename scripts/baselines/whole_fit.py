"""What `bowdenfit fit` does, as a program that calls the library: the same data set, figures and files."""

import sys

import bowdenfit as bf

bf.fit(sys.argv[1], output=sys.argv[2], seed=int(sys.argv[3]))
