"""Figures: functions from `bowdenfit.results.figure_data.FigureData` to a matplotlib Figure, one file a family.

`bowdenfit.plots.gallery` lists them all and writes them to a folder. Nothing here loads JAX, touches pyplot or changes
matplotlib's settings.
"""
