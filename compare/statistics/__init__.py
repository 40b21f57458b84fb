"""Statistics of errors: descriptive, chi-square, block bootstrap for series correlated in time, Monte-Carlo runs."""
