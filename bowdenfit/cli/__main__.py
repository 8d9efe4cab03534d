"""`python -m bowdenfit.cli` is `bowdenfit`."""

from bowdenfit.cli import start

if __name__ == "__main__":
    start()
