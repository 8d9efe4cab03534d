"""One HTML page for people: sections in a row, figures inside, nothing to fetch; knows no question and no fit."""
