"""Parameters, declared once: name, unit, symbol, prior and meaning."""
