"""One folder a question that users ask of a fit, or of measurements before they are fitted."""
