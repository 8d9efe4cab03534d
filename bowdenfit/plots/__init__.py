"""Style, layout and elements that the figures of all questions share; changes no setting of matplotlib."""
