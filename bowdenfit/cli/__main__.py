"""`python -m bowdenfit.cli` is `bowdenfit`."""

from bowdenfit.cli import main

if __name__ == "__main__":
    main()
